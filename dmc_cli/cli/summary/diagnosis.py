"""Tell what an installation has."""

from collections.abc import Iterator
from typing import Any


def doctor_lines(diagnosis: dict[str, Any]) -> Iterator[str]:
    """Yield the lines of `dmc doctor`."""
    yield f"platform  {diagnosis['platform']}"
    yield f"python    {diagnosis['python']}"
    yield "packages  " + ", ".join(
        f"{name} {found or 'missing'}" for name, found in diagnosis["packages"].items()
    )
    for device in diagnosis["devices"]:
        memory = device["memory_bytes"]
        cores = f"{diagnosis['cpu_cores']} core(s)" if device["alias"] == "cpu" else ""
        yield f"device    {device['alias']}: {device['name']} {cores or f'{memory / 2**30:.1f} GiB'}"
    if len(diagnosis["devices"]) == 1:
        yield "device    cuda: no usable CUDA device was found; everything runs on the CPU"
    for name, available in diagnosis["codecs"].items():
        yield f"codec     DICOM {name}: {'available' if available else 'missing'}"
    launches = diagnosis["launches"]
    yield f"launches  {launches['fallback'] or str(launches['threads']) + ' CPU thread(s) share each'}"
    cache = diagnosis["kernel_cache"]
    size = cache["bytes"] / 2**20
    yield f"kernels   {cache['modules']} compiled module(s), {size:.1f} MiB in {cache['path']}"
