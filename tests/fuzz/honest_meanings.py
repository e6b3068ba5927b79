"""Honest files of which more has to be understood than a grid: factors, makers' elements, scales, logs."""

import numpy as np
from pydicom.sequence import Sequence

from tests.volume_io.dicom.scanner import axial, make_slice, plane_values, save
from tests.volume_io.dicom.test_factors import nuclear
from tests.volume_io.dicom.test_frames import enhanced, sequence
from tests.volume_io.dicom.test_philips import add_scale
from tests.volume_io.dicom.test_scale import table
from tests.volume_io.dicom.test_segments import random_masks, segmentation
from tests.volume_io.dicom.test_siemens import mosaic, random_planes, with_csa

VALUES = np.arange(6 * 7 * 8, dtype="<i2").reshape(6, 7, 8)


def make_dicom(folder):
    """Files whose frames and values need more than positions: segments, time slots, a lookup table."""
    planes = [(1, 0), (2, 4), (1, 4), (2, 2)]
    paths = [save(segmentation(planes, random_masks(4)), folder / "segments")]
    dataset, _ = nuclear({"TimeSlotVector": [1, 1, 2, 2], "SliceVector": [1, 2] * 2}, 4)
    paths.append(save(dataset, folder / "slots"))
    dataset, _ = enhanced([0, 2, 4, 0, 2, 4], BitsStored=12, HighBit=11)
    for n, group in enumerate(dataset.PerFrameFunctionalGroupsSequence):
        lut = Sequence([table(0, range(100 * n, 100 * n + 300))])
        group.PixelValueTransformationSequence = sequence(ModalityLUTSequence=lut)
        group.FrameContentSequence = sequence(DimensionIndexValues=[n // 3 + 1, n % 3 + 1])
    return [*paths, save(dataset, folder / "tables")]


def make_makers(folder):
    """Elements of GE, Philips and Siemens; a slice of each maker, or a mosaic, is damaged."""
    paths = [save(mosaic(random_planes(4)), folder / "mosaic" / "a")]
    for maker in ("ge", "philips", "siemens"):
        for number in range(2):
            for k, position in enumerate(axial(2)):
                dataset = make_slice(position, k, values=plane_values(k, "<i2", (8, 8)))
                _add_own(dataset, maker, number)
                path = save(dataset, folder / maker / f"{number}{k}")
        paths.append(path)
    return paths


def _add_own(dataset, maker, number):
    if maker == "ge":
        dataset.add_new(0x00430010, "LO", "GEMS_PARM_01")
        dataset.add_new(0x00431039, "IS", [1000 * number, 8, 0, 0])
    elif maker == "philips":
        add_scale(dataset, 0.25, 0.0)
        dataset.add_new(0x20010010, "LO", "Philips Imaging DD 001")
        dataset.add_new(0x20011003, "FL", 700.0 * number)
    else:
        with_csa(
            dataset, {"B_value": [str(500 * number)], "DiffusionGradientDirection": ["0.5", "0.5", "0.7"]}
        )


def make_hdf5(folder):
    """Scaled values with places along dimensions, axes of NeXus, an image of Imaris."""
    import h5py

    from tests.volume_io.hdf5.test_imaris import imaris

    with h5py.File(folder / "cf.h5", "w") as file:
        data = file.create_dataset("temperature", data=VALUES)
        data.attrs.update(scale_factor=0.5, add_offset=-10.0, _FillValue=np.int16(-1), units="K")
        for axis, name in enumerate(("depth", "north", "east")):
            file[name] = np.arange(VALUES.shape[axis]) * 2.0
            file[name].attrs["units"] = "m"
            file[name].make_scale(name)
            data.dims[axis].attach_scale(file[name])
    with h5py.File(folder / "nexus.nxs", "w") as file:
        file.attrs["default"] = "entry"
        entry = file.create_group("entry")
        entry.attrs.update(NX_class="NXentry", default="data")
        data = entry.create_group("data")
        data.attrs.update(NX_class="NXdata", signal="values", axes=["time", "z", "y", "x"])
        data["values"] = np.stack([VALUES, VALUES])
        for axis, size in zip(("time", "z", "y", "x"), (2, *VALUES.shape), strict=True):
            data[axis] = np.arange(size) * 0.5
            data[axis].attrs["units"] = "s" if axis == "time" else "um"
    return [folder / "cf.h5", folder / "nexus.nxs", imaris(folder / "image.ims")]


def make_logs(folder):
    """Folders of TIFF slices with the text of a scanner; both are damaged."""
    import tifffile

    texts = {
        "skyscan": "[Reconstruction]\nSections Count=6\nResult Image Width (pixels)=8\nPixel Size (um)=9\n",
        "scanco": "Orig-ISQ-Dim-p  8 7 6\nOrig-ISQ-Dim-um  160 140 120\n",
    }
    paths = []
    for name, text in texts.items():
        (folder / name).mkdir()
        for k, plane in enumerate(VALUES.astype("u2")):
            tifffile.imwrite(folder / name / f"rec{k:04d}.tif", plane, photometric="minisblack")
        (folder / name / "rec.log").write_text(text)
        paths += [folder / name / "rec0005.tif", folder / name / "rec.log"]
    return paths
