"""Ten volumes as unlike as can be, in files: how to make each, to write it and to convert it.

They are so large that modules that a run imports, some MiB, do not count beside them.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import nibabel
import nrrd
import numpy as np

from tests.volume_io.dicom.scanner import make_slice, save


def iwp(shape: tuple[int, int, int], waves: float = 2.0) -> np.ndarray:
    """Return a smooth field with much surface, shape (nz, ny, nx)."""
    axes = (np.linspace(-np.pi * waves, np.pi * waves, n, dtype=np.float32) for n in shape)
    z, y, x = np.meshgrid(*axes, indexing="ij", sparse=True)
    pairs = np.cos(x) * np.cos(y) + np.cos(y) * np.cos(z) + np.cos(z) * np.cos(x)
    return 2 * pairs - (np.cos(2 * x) + np.cos(2 * y) + np.cos(2 * z)) + np.float32(0.01)


def noise(shape: tuple[int, int, int]) -> np.ndarray:
    """Return white noise, in which every second cell is special."""
    return np.random.default_rng(3).standard_normal(shape, np.float32)


def with_holes(values: np.ndarray) -> np.ndarray:
    """Return values with nodes that hold no data."""
    values[::40, ::40, ::40] = np.nan
    return values


def write_npy(path: Path, values: np.ndarray) -> Path:
    np.save(path.with_suffix(".npy"), values)
    return path.with_suffix(".npy")


def write_raw(path: Path, values: np.ndarray) -> Path:
    values.tofile(path.with_suffix(".raw"))
    return path.with_suffix(".raw")


def write_nrrd(path: Path, values: np.ndarray) -> Path:
    nrrd.write(str(path.with_suffix(".nrrd")), values, {"encoding": "gzip"}, index_order="C")
    return path.with_suffix(".nrrd")


def write_nifti(path: Path, values: np.ndarray) -> Path:
    nibabel.save(nibabel.Nifti1Image(values.T, np.eye(4)), path.with_suffix(".nii.gz"))
    return path.with_suffix(".nii.gz")


def write_dicom(path: Path, values: np.ndarray) -> Path:
    for k, plane in enumerate(values):
        save(make_slice([0, 0, k], k, values=plane), path / f"{k}.dcm")
    return path


@dataclass(frozen=True)
class Case:
    """A volume: its values, how to write them, and options that it is converted with."""

    values: Callable[[], np.ndarray]
    write: Callable[[Path, np.ndarray], Path]
    options: tuple[str, ...] = ("-i", "0")


VOLUMES = {
    "smooth, mapped": Case(lambda: iwp((192, 192, 192), 3), write_npy),
    "white noise": Case(lambda: noise((100, 100, 100)), write_npy),
    "bytes, compressed": Case(
        lambda: (20 * iwp((224, 224, 224)) + 128).astype(np.uint8), write_nrrd, ("-i", "128.5")
    ),
    "shorts, compressed": Case(lambda: (200 * iwp((200, 200, 200))).astype(np.int16), write_nifti),
    "doubles without data": Case(lambda: with_holes(iwp((200, 200, 200), 4).astype(np.float64)), write_nifti),
    "long integers": Case(lambda: (1000 * iwp((208, 208, 208), 4)).astype(np.int64), write_npy),
    "flat, closed": Case(lambda: iwp((6, 720, 720), 40), write_npy, ("-i", "0", "--border", "closed")),
    "thin": Case(lambda: iwp((620, 620, 5), 30), write_nrrd),
    "slices": Case(
        lambda: (200 * iwp((160, 256, 256), 4)).astype(np.int16),
        write_dicom,
        ("-i", "-1024", "--space", "ras"),
    ),
    "large, little surface": Case(
        lambda: np.pad(np.full((120, 120, 120), 200, np.uint8), 140, constant_values=10),
        write_raw,
        ("-i", "100", "--shape", "400,400,400", "--dtype", "uint8"),
    ),
}
