"""A scanner for the tests: writes DICOM slices with chosen geometry, values and encoding."""

import numpy as np
import pydicom
from pydicom.dataset import FileMetaDataset
from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian, generate_uid

AXIAL = (1.0, 0, 0, 0, 1, 0)


def plane_values(k, dtype="<i2", shape=(4, 5)):
    """Values that differ from slice to slice and from node to node."""
    return (np.arange(np.prod(shape)).reshape(shape) + 100 * k).astype(dtype)


def make_slice(
    position, k, *, values=None, series="1.2.3", orientation=AXIAL, syntax=ExplicitVRLittleEndian, **elements
):
    """A CT slice; `elements` are further elements by keyword, None to leave one out."""
    values = plane_values(k) if values is None else values
    meta = FileMetaDataset()
    meta.TransferSyntaxUID = syntax
    meta.MediaStorageSOPClassUID = CTImageStorage
    meta.MediaStorageSOPInstanceUID = generate_uid()
    dataset = pydicom.Dataset()
    dataset.file_meta = meta
    bits = values.dtype.itemsize * 8
    fields = {
        "ImageType": ["ORIGINAL", "PRIMARY", "AXIAL"],
        "SOPClassUID": CTImageStorage,
        "SOPInstanceUID": meta.MediaStorageSOPInstanceUID,
        "Modality": "CT",
        "SeriesDescription": f"series {series}",
        "SeriesInstanceUID": series,
        "SeriesNumber": series.rsplit(".", 1)[-1],
        "InstanceNumber": str(k),
        "ImagePositionPatient": [float(x) for x in position],
        "ImageOrientationPatient": [float(x) for x in orientation],
        "PixelSpacing": [0.5, 0.75],
        "SamplesPerPixel": 1,
        "PhotometricInterpretation": "MONOCHROME2",
        "Rows": values.shape[0],
        "Columns": values.shape[1],
        "BitsAllocated": bits,
        "BitsStored": bits,
        "HighBit": bits - 1,
        "PixelRepresentation": int(values.dtype.kind == "i"),
        "RescaleSlope": "1",
        "RescaleIntercept": "-1024",
        "PixelData": values.tobytes(),
        **elements,
    }
    for key, value in fields.items():
        if value is not None:
            setattr(dataset, key, value)
    dataset["PixelData"].VR = "OW"
    return dataset


def save(dataset, path, **options):
    path.parent.mkdir(parents=True, exist_ok=True)
    dataset.save_as(path, **{"enforce_file_format": True, **options})
    return path


def save_stack(folder, positions, names=None, **options):
    """One slice a position, in files whose names say nothing about the order."""
    order = np.random.default_rng(1).permutation(len(positions))
    for k, position in enumerate(positions):
        name = f"IM{order[k]:04d}" if names is None else names[k]
        save(make_slice(position, k, **options), folder / name)
    return folder


def axial(count=4, step=2.0):
    return [(10.0, 20.0, 30.0 + step * k) for k in range(count)]


STACK = np.array([plane_values(k) for k in range(4)])
"""The values of four slices."""
