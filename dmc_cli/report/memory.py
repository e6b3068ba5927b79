"""Tell how much memory a run took."""

import warp as wp

from dmc_cli.system import peak_memory


def measure_memory(device_name: str) -> dict[str, int | None]:
    """Return the largest resident memory of this process so far and the most that a GPU's pool gave out.

    The former is None where the system does not tell it, `device_bytes` on CPU, whose arrays are part of
    the process, and where the driver keeps no count.

    Args:
        device_name: Warp's name of the device: cpu, cuda:0, ...
    """
    return {"peak_rss_bytes": peak_memory(), "device_bytes": _pool_peak(device_name)}


def _pool_peak(device_name: str) -> int | None:
    device = wp.get_device(device_name)
    if not device.is_cuda or not wp.is_mempool_enabled(device):
        return None
    return int(wp.get_mempool_used_mem_high(device))
