"""Describe volumes and installations for `dmc info` and `dmc doctor`, as values that JSON can hold."""

import platform
import sys
from collections.abc import Sequence
from dataclasses import asdict, replace
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from dmc_cli.cli.histogram import binned
from dmc_cli.errors import AmbiguousVolumeError, SettingsError, VolumeError, WriteError
from dmc_cli.notices import Notice, warning_keys
from dmc_cli.progress import Progress
from dmc_cli.settings import STREAM, ReadSettings
from dmc_cli.system import usable_cores
from dmc_cli.version import VERSION
from dmc_cli.volume import Suggestions, Volume, VolumeEntry, find_labels, intact
from dmc_cli.volume_io import survey_volumes

_PACKAGES = (
    "warp-lang", "numpy", "pydicom", "nibabel", "meshio", "isal", "orjson", "click", "rich",
)  # fmt: skip


def describe(
    path: str,
    settings: ReadSettings,
    progress: Progress,
    isovalues: Sequence[float | str | None] | None = None,
    components_at: Sequence[float | str | None] | None = None,
) -> dict[str, Any]:
    """Tell what a volume is, and which volumes its path offers; with isovalues, what surfaces it has there.

    No isovalues at all, or None among them, stand for round numbers over the volume's range; None leaves
    surfaces out. `components_at` are isovalues whose objects' components are listed, None among them for the
    one that convert takes.
    Where there are several series and none is chosen only the list is given: no value is read.
    """
    entries, volume, notes = _surveyed(path, settings, progress)
    series = [
        {
            "number": entry.number,
            "description": entry.description,
            "modality": entry.modality,
            "size": list(entry.size),
            "slices": entry.slices,
            "uid": entry.uid,
            "volumes": list(entry.volumes),
        }
        for entry in entries
    ]
    if volume is None:
        return {"path": path, "series": series}
    suggestions = Suggestions(volume)
    with intact(volume.values, path), progress.stage("counting values"):
        ends, suggested = suggestions.ends, [asdict(one) for one in suggestions.suggested()]
        kind, counted = suggestions.kind, suggestions.histogram
        is_map = bool(volume.labels) or kind == "label map"
        labels = _labels(volume, settings.volume_index or 0) if is_map else {}
    spectrum: dict[str, Any] = {}
    if isovalues is not None:
        from dmc_cli.app import contour_spectrum

        levels = [_number(isovalue, suggestions) for isovalue in isovalues if isovalue is not None]
        spectrum["isovalues"] = contour_spectrum(volume, levels, settings.threads, progress)
    if components_at is not None:
        from dmc_cli.app import list_object_components

        levels = [_number(isovalue, suggestions) for isovalue in components_at]
        spectrum["components"] = list_object_components(volume, levels, settings.threads, progress)
    return {
        "path": path,
        "format": volume.format,
        "files": len(volume.files),
        "shape": list(volume.shape),
        "dtype": volume.values.dtype.name,
        "spacing_mm": list(volume.spacing),
        "space": volume.space,
        "affine": volume.affine.tolist(),
        "slope": volume.slope,
        "intercept": volume.intercept,
        "value_range": None if ends is None else list(ends),
        "kind": kind,
        "value_unit": volume.value_unit,
        "suggested_isovalues": suggested,
        "histogram": binned(counted.values.tolist(), counted.counts.tolist(), counted.ends),
        "series": series,
        **labels,
        **spectrum,
        **warning_keys([*notes, *volume.warnings]),
    }


def _labels(volume: Volume, layer: int) -> dict[str, Any]:
    """Return the labels of a label map, their names, colours and nodes; nothing where values are shares."""
    named = {label.value: label for label in volume.labels if label.layer == layer}
    try:
        found = find_labels(volume)
    except VolumeError:
        return {}
    rows = [
        {
            "label": named[value].number if value in named else value,
            "name": named[value].name if value in named else "",
            "color": named[value].color if value in named else None,
            "nodes": nodes,
        }
        for value, nodes in zip(found.labels.tolist(), found.counts.tolist(), strict=True)
    ]
    return {"labels": rows}


def _number(isovalue: float | str | None, suggestions: Suggestions) -> float:
    """Return an isovalue as a number of the volume.

    Raises:
        SettingsError: It is a band, whose surface is that of other values.
    """
    if isinstance(isovalue, float):
        return isovalue
    chosen = suggestions.choose(isovalue)
    if chosen.band is not None:
        raise SettingsError(
            f"isovalue is {isovalue!r}, a band; expected isovalues of the volume's own values; give its ends"
            " as numbers"
        )
    return chosen.isovalue


def _surveyed(
    path: str, settings: ReadSettings, progress: Progress
) -> tuple[list[VolumeEntry], Volume | None, list[Notice]]:
    """Return what there is, and the volume, of several in one file the first with a note that says so."""
    try:
        return *survey_volumes(path, settings, progress), []
    except AmbiguousVolumeError as error:
        if path == STREAM or settings.volume_index is not None:
            raise
        told = Notice("W-FIRST-VOLUME", f"{error}; this is volume 0")
        return *survey_volumes(path, replace(settings, volume_index=0), progress), [told]


def diagnose() -> dict[str, Any]:
    """Tell the versions, the devices, the codecs and the kernel cache of this installation."""
    return {
        "platform": f"{platform.system()} {platform.release()} {platform.machine()}",
        "python": f"{platform.python_version()} ({sys.executable})",
        "cpu_cores": usable_cores(),
        "packages": {"dmc-cli": VERSION} | {name: _version(name) for name in _PACKAGES},
        "devices": _devices(),
        "codecs": _codecs(),
        "launches": _launches(),
        "kernel_cache": _kernel_cache(),
    }


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _devices() -> list[dict[str, Any]]:
    """Return all devices that Warp sees, the CPU first."""
    import warp as wp

    from dmc_cli.runtime import initialize_warp

    initialize_warp()
    found = [{"alias": "cpu", "name": platform.processor() or platform.machine(), "memory_bytes": None}]
    found.extend(
        {
            "alias": device.alias,
            "name": device.name,
            "arch": device.arch,
            "memory_bytes": device.total_memory,
            "free_bytes": device.free_memory,
        }
        for device in wp.get_cuda_devices()
    )
    return found


def _codecs() -> dict[str, bool]:
    """Tell which kinds of DICOM's compressed pixel data the installed packages decode."""
    from pydicom import uid
    from pydicom.pixels.decoders.base import get_decoder

    kinds = {
        "RLE": uid.RLELossless,
        "JPEG baseline": uid.JPEGBaseline8Bit,
        "JPEG lossless": uid.JPEGLosslessSV1,
        "JPEG-LS": uid.JPEGLSLossless,
        "JPEG 2000": uid.JPEG2000Lossless,
        "HTJ2K": uid.HTJ2KLossless,
    }
    return {name: get_decoder(syntax).is_available for name, syntax in kinds.items()}


def _launches() -> dict[str, Any]:
    """Return how many CPU threads share a launch, and why only one where Warp is the reason."""
    from dmc_cli.runtime import launch_fallback

    try:
        fallback = launch_fallback()
    except WriteError as error:  # which the next run tells as an error
        return {"threads": None, "fallback": str(error)}
    return {"threads": 1 if fallback else usable_cores(), "fallback": fallback}


def _kernel_cache() -> dict[str, Any]:
    """Return where Warp keeps compiled kernels, and how much is there."""
    from dmc_cli.runtime import cache_folder

    folder = cache_folder()
    files = [file for file in folder.rglob("*") if file.is_file()] if folder.is_dir() else []
    return {
        "path": str(folder),
        "modules": sum(file.suffix in {".o", ".cubin", ".ptx"} for file in files),
        "bytes": sum(file.stat().st_size for file in files),
    }
