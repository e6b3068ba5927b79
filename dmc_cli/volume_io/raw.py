"""Read raw files: nothing but values, x fastest; the user gives shape, type and spacing.

The size of the file must be what shape, type and skipped bytes give: a wrong shape would still make
a mesh, of nonsense.
"""

import math
from pathlib import Path

import numpy as np

from dmc_cli.errors import DamagedVolumeError, SettingsError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume import check_shape
from dmc_cli.volume_io.layout import Layout, check_file, chosen_origin, chosen_spacing, scale_affine
from dmc_cli.volume_io.packed import SUFFIXES

RAW_TYPES = ("uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64", "float32", "float64")
"""What `--dtype` takes."""


def raw_layout(path: Path, name: str, settings: ReadSettings) -> Layout:
    """Return the layout of a raw file as the settings describe it; its suffix tells what packs it.

    Raises:
        SettingsError: Shape or type are missing, or the type is unknown.
        DamagedVolumeError: The file is smaller or larger than the settings say.
    """
    if settings.shape is None or settings.dtype is None:
        raise SettingsError(
            f"{name}: a raw file needs its shape and type; expected --shape X,Y,Z and --dtype "
            f"{'|'.join(RAW_TYPES)}"
        )
    if settings.dtype not in RAW_TYPES:
        raise SettingsError(f"dtype is {settings.dtype!r}; expected one of {', '.join(RAW_TYPES)} (--dtype)")
    dtype = np.dtype(settings.dtype).newbyteorder("<" if settings.byte_order == "little" else ">")
    check_shape(name, settings.shape)
    found = check_file(path, name)
    packing = SUFFIXES.get(path.suffix.lower())
    expected = settings.skip_bytes + math.prod(settings.shape) * dtype.itemsize
    if packing is None and found != expected:
        skipped = f" after {settings.skip_bytes} skipped bytes" if settings.skip_bytes else ""
        remedy = f"; if it begins with a header, --skip-bytes {found - expected + settings.skip_bytes}"
        raise DamagedVolumeError(
            f"{name}: {found} bytes found, {expected} expected for {' x '.join(map(str, settings.shape))} "
            "values of "
            f"{settings.dtype}{skipped}; check --shape and --dtype{remedy if found > expected else ''}"
        )
    spacing, warnings = chosen_spacing(None, settings, "a raw file")
    origin, _ = chosen_origin(None, settings)
    return Layout(
        name=name,
        shape=settings.shape,
        dtype=dtype,
        affine=scale_affine(spacing, origin),
        space="none",
        files=(path,),
        offset=settings.skip_bytes,
        encoding=packing or "raw",
        format="raw",
        warnings=warnings,
    )
