"""How much memory a run took."""

import resource
import sys

import warp as wp

RSS_UNIT = 1 if sys.platform == "darwin" else 1024
"""Bytes in the unit of `ru_maxrss`: Linux counts kibibytes, macOS bytes."""


def measure_memory(device_name: str) -> dict[str, int | None]:
    """Return the largest resident memory of this process so far and the most that a GPU's pool gave out.

    `device_bytes` is None on CPU, whose arrays are part of the process, and where the driver keeps no count.

    Args:
        device_name: Warp's name of the device: cpu, cuda:0, ...
    """
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * RSS_UNIT
    return {"peak_rss_bytes": peak, "device_bytes": _pool_peak(device_name)}


def _pool_peak(device_name: str) -> int | None:
    device = wp.get_device(device_name)
    if not device.is_cuda or not wp.is_mempool_enabled(device):
        return None
    return int(wp.get_mempool_used_mem_high(device))
