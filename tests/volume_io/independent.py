"""Read a file's volumes with libraries that are not the program's own: NumPy arrays and places, nothing else.

Each reader yields every volume in the order of the program's `--series` and `--volume-index`. DICOM, whose
volumes are the program's to find, yields planes instead, each with the place of its first pixel.
"""

import io
import json
import re
import zipfile
from dataclasses import dataclass

import nibabel as nib
import nrrd
import numpy as np
import pydicom
import SimpleITK as sitk  # noqa: N813 -- its own documentation calls it so
import tifffile
from PIL import Image
from pydicom.pixels import apply_modality_lut

from tests.volume_io.reading import LPS_OF_RAS


@dataclass
class Found:
    """Physical values [k, j, i], and node index to millimetres in LPS, or in the grid's own axes."""

    values: np.ndarray
    affine: np.ndarray


@dataclass
class FoundPlane:
    """Physical values [j, i] of a DICOM frame; its corner and edges in LPS, None where it has no place."""

    values: np.ndarray
    corner: np.ndarray | None
    edges: np.ndarray | None


def scaled(spacing, origin=(0.0, 0.0, 0.0)):
    affine = np.diag([*spacing, 1.0])
    affine[:3, 3] = origin
    return affine


def with_nibabel(path):
    image = nib.load(path)
    values = np.asanyarray(image.dataobj, np.float64)
    values = values.reshape(*values.shape[:3], -1, order="F")
    header = image.header
    if isinstance(image, nib.Nifti1Pair) and header["sform_code"] <= 0 and header["qform_code"] <= 0:
        affine = scaled(header.get_zooms()[:3])  # no orientation: nibabel would centre and flip
    else:
        affine = LPS_OF_RAS @ image.affine
    for number in range(values.shape[3]):
        yield Found(values[..., number].T, affine)


def with_itk(path):
    image = sitk.ReadImage(str(path))
    values = sitk.GetArrayFromImage(image)
    direction = np.array(image.GetDirection()).reshape(image.GetDimension(), -1)[:3, :3]
    affine = scaled((1, 1, 1), image.GetOrigin()[:3])
    affine[:3, :3] = direction * np.array(image.GetSpacing()[:3])
    volumes = values if image.GetDimension() == 4 else [values]
    for volume in volumes:
        parts = np.moveaxis(volume, 3, 0) if volume.ndim == 4 else [volume]
        for part in parts:
            yield Found(part, affine)


def with_pynrrd(path):
    """Return what SimpleITK does not read: packed by bzip2, or with several numbers a node, at the front."""
    values, header = nrrd.read(str(path), index_order="C")
    affine = scaled(header.get("spacings", (1, 1, 1))[-3:], header.get("space origin", (0, 0, 0)))
    if "space directions" in header:
        affine[:3, :3] = np.array([d for d in header["space directions"] if np.isfinite(d).all()]).T
    for volume in np.moveaxis(values, 3, 0) if values.ndim == 4 else [values]:
        yield Found(volume, affine)


def with_parts(path):
    """Return slices that follow their header's pattern, which neither SimpleITK nor pynrrd reads."""
    told = dict(line.split(": ") for line in path.read_text().splitlines() if ": " in line)
    x, y, z = map(int, told["sizes"].split())
    pattern, first, *_ = told["data file"].split()
    planes = [np.fromfile(path.parent / (pattern % (int(first) + k)), "<i2") for k in range(z)]
    yield Found(np.stack(planes).reshape(z, y, x), scaled(map(float, told["spacings"].split())))


def with_numpy(path):
    loaded = np.load(path)
    arrays = [loaded[key] for key in loaded] if path.suffix == ".npz" else [loaded]
    for whole in arrays:
        array = whole.squeeze() if whole.squeeze().ndim == 3 else whole
        for volume in array.reshape(-1, *array.shape[-3:]):
            yield Found(volume, np.eye(4))


def with_tifffile(path):
    with tifffile.TiffFile(path) as tiff:
        for series in tiff.series:
            order = [series.axes.index(letter) for letter in "ZYX" if letter in series.axes]
            others = [n for n in range(len(series.axes)) if n not in order]
            if len(order) < 3:
                continue
            values = series.asarray().transpose([*others, *order])
            for volume in values.reshape(-1, *values.shape[-3:]):
                yield Found(volume, scaled(_tiff_spacing(tiff)))


def _tiff_spacing(tiff):
    """The spacing in millimetres of a file in micrometres."""
    if tiff.is_ome:
        told = [re.search(rf'PhysicalSize{axis}="([^"]+)"', tiff.ome_metadata)[1] for axis in "XYZ"]
        units = re.findall(r'PhysicalSize.Unit="([^"]+)"', tiff.ome_metadata)
        assert set(units) <= {"µm"}
        return [float(length) / 1000 for length in told]
    assert tiff.imagej_metadata["unit"] in ("um", "micron")
    (count, length), (rows, height) = (tiff.pages[0].tags[f"{axis}Resolution"].value for axis in "XY")
    return [length / count / 1000, height / rows / 1000, tiff.imagej_metadata["spacing"] / 1000]


def with_slices(path):
    """Return a folder of images as a stack, in the order of the numbers in their names."""
    files = [p for p in path.iterdir() if p.suffix in (".tif", ".png") and re.search(r"\d{3,}", p.stem)]
    files.sort(key=lambda file: int(re.findall(r"\d+", file.stem)[-1]))
    planes = [tifffile.imread(p) if p.suffix == ".tif" else np.array(Image.open(p)) for p in files]
    log = next(path.glob("*_rec.log"), None)
    size = float(re.search(r"Pixel Size \(um\)=([0-9.]+)", log.read_text())[1]) / 1000 if log else 1.0
    yield Found(np.stack(planes), scaled([size] * 3))


UNITS = {
    **{"picometer": 1e-9, "angstrom": 1e-7, "nanometer": 1e-6, "micrometer": 1e-3, "millimeter": 1.0},
    **{"centimeter": 10.0, "inch": 25.4, "nounit": 1.0},
}
"""UDUNITS' names to millimetres, as far as the stores have them."""


def with_zarr(path):
    """Return the finest level of each image; a store of bioformats2raw holds some in 0, 1, ..."""
    import zarr

    attributes = json.loads((path / ".zattrs").read_text())
    if "multiscales" not in attributes:
        for folder in sorted(p for p in path.iterdir() if p.is_dir()):
            yield from with_zarr(folder)
        return
    for image in attributes["multiscales"]:
        level = image["datasets"][0]
        values = zarr.open_array(str(path / level["path"]), mode="r")[...]
        axes = image.get("axes", [])
        told = [axis.get("unit", "nounit") for axis in axes[-3:] if isinstance(axis, dict)]
        unit = [UNITS[spelled] for spelled in told] or [1.0] * 3
        step = level.get("coordinateTransformations", [{"scale": [1.0] * 3}])[0]["scale"][-3:]
        spacing = [length * factor for length, factor in zip(step, unit, strict=True)][::-1]
        for volume in values.reshape(-1, *values.shape[-3:]):
            yield Found(volume, scaled(spacing))


def planes_with_pydicom(path):
    """Return the frames of a DICOM file, a folder or a zip with some, in no order that tells anything."""
    for file in _dicom_files(path):
        try:
            dataset = pydicom.dcmread(file)
            pixels = dataset.pixel_array
        except (pydicom.errors.InvalidDicomError, AttributeError):
            continue  # no DICOM, or one without an image
        frames = pixels[None] if pixels.ndim == 2 else pixels
        for number, frame in enumerate(frames):
            yield _plane(dataset, number, frame)


def _dicom_files(path):
    if path.suffix == ".zip":
        with zipfile.ZipFile(path) as archive:
            yield from (io.BytesIO(archive.read(entry)) for entry in archive.infolist())
    else:
        yield from [path] if path.is_file() else (p for p in path.iterdir() if p.is_file())


def _plane(dataset, number, frame):
    groups = [
        *dataset.get("PerFrameFunctionalGroupsSequence", [])[number : number + 1],
        *dataset.get("SharedFunctionalGroupsSequence", []),
    ]

    def told(sequence):
        return next((g[sequence].value[0] for g in groups if sequence in g), dataset)

    values = apply_modality_lut(frame, told("PixelValueTransformationSequence")).astype(np.float64)
    values = values * float(dataset.get("DoseGridScaling", 1.0))
    position = told("PlanePositionSequence").get("ImagePositionPatient")
    cosines = told("PlaneOrientationSequence").get("ImageOrientationPatient")
    offsets = dataset.get("GridFrameOffsetVector")
    is_one_of_all = int(dataset.get("NumberOfFrames", 1)) > 1 and not groups and not offsets
    if position is None or cosines is None or is_one_of_all:
        return FoundPlane(values, None, None)
    corner = np.array(position, float)
    along_x, along_y = np.array(cosines, float).reshape(2, 3)
    row, column = map(float, told("PixelMeasuresSequence").get("PixelSpacing"))
    if offsets:
        # relative to the first plane, or patient z where the first one is that (PS3.3 C.8.8.3.2)
        from_first = np.array(offsets, float) - float(offsets[0])
        corner = corner + from_first[number] * np.cross(along_x, along_y)
    return FoundPlane(values, corner, np.array([along_x * column, along_y * row]))
