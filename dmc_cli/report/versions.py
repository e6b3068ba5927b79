"""Collect the versions that a result depends on."""

import platform

import numpy as np
import warp as wp

from dmc_cli.version import VERSION


def collect_versions(device_name: str) -> dict[str, str]:
    """Return the versions of this package and of what its results rest on, and the device.

    Args:
        device_name: Warp's name of the device: cpu, cuda:0, ...
    """
    return {
        "dmc_cli": VERSION,
        "warp": str(wp.config.version),
        "numpy": np.__version__,
        "python": platform.python_version(),
        "device": _describe_device(device_name),
    }


def _describe_device(name: str) -> str:
    """Return what a user calls the device: the GPU's model, the CPU's architecture."""
    if name == "cpu":
        return f"cpu ({platform.machine()})"
    return f"{name} ({wp.get_device(name).name})"
