"""What docs/formats/*.md calls not used changes nothing: neither values nor places, nor a word of warning."""

import struct

import nibabel as nib
import numpy as np
import pytest

from tests.volume_io.afni_files import afni_header
from tests.volume_io.dicom.scanner import axial, save_stack
from tests.volume_io.minc_files import hdf, netcdf
from tests.volume_io.par_files import par_header, same_scales
from tests.volume_io.reading import counting, read
from tests.volume_io.test_afni import write as write_afni
from tests.volume_io.test_analyze import write as write_analyze
from tests.volume_io.test_mgh import changed, write as write_mgh
from tests.volume_io.test_parrec import write as write_parrec

VALUES = counting((3, 4, 5))


def assert_same(volume, right):
    """Compare all that a reader tells."""
    np.testing.assert_array_equal(volume.values, right.values)
    np.testing.assert_array_equal(volume.affine, right.affine)
    assert (volume.space, volume.slope, volume.intercept) == (right.space, right.slope, right.intercept)
    assert volume.padding == right.padding
    assert [notice.code for notice in volume.warnings] == [notice.code for notice in right.warnings]


@pytest.mark.parametrize(
    "fields",
    [
        {"pixdim": [1, 2, 3, 4, -7, np.nan, 9, 9]},
        {"cal_max": 5, "cal_min": 99, "glmax": 3, "glmin": -3, "extents": 16384, "regular": b"x"},
        {"views": 3, "start_field": 9, "field_skip": 7, "omax": 1, "omin": 2, "smax": 3, "smin": 4},
        {
            "descrip": b"units: um",
            "aux_file": b"other",
            "patient_id": b"7",
            "orient": b"\4",
            "cal_units": b"um",
        },
    ],
    ids=str,
)
def test_analyze(tmp_path, fields):
    right = read(write_analyze(tmp_path / "a.img", VALUES))
    known = nib.Spm2AnalyzeHeader().keys()
    assert fields.keys() <= {*known}
    assert_same(read(write_analyze(tmp_path / "b.img", VALUES, **fields)), right)


@pytest.mark.parametrize(
    "fields",
    [
        {"cal_min": 7, "cal_max": 3, "descrip": b"unit um", "aux_file": b"other.nii", "db_name": b"x"},
        {"intent_code": 1007, "intent_name": b"vector", "intent_p1": 1, "intent_p2": 2, "intent_p3": np.nan},
        {"toffset": 50, "slice_duration": 9},
        {"pixdim": [1, 2, 3, 4, np.nan, 1e30, -1, 0]},
        {"data_type": b"dsr", "extents": 16384, "session_error": 3, "regular": b"r"},
        *({"xyzt_units": 2 + 8 * time} for time in range(1, 7)),
    ],
    ids=str,
)
def test_nifti(tmp_path, fields):
    image = nib.Nifti1Image(VALUES.T, np.diag([2, 3, 4, 1]))
    image.header.set_xyzt_units("mm")
    nib.save(image, tmp_path / "a.nii")
    for key, value in fields.items():
        image.header[key] = value
    image.header.extensions.append(nib.nifti1.Nifti1Extension("comment", b"unit: inch"))
    (tmp_path / "b.nii").write_bytes(image.to_bytes())
    right, volume = read(tmp_path / "a.nii"), read(tmp_path / "b.nii")
    assert right.warnings == ()
    assert_same(volume, right)


@pytest.mark.parametrize(
    "line",
    [
        "measurement frame: (0,1,0) (1,0,0) (0,0,1)",
        'sample units: "um"',
        "content: unit um\nnumber: 7",
        "block size: 4",
        "thicknesses: 9 9 9",
        "Segment0_Name:=skin\nSegment0_Extent:=0 1 0 1 0 1",
        "modality:=DWMRI\nDWMRI_gradient_0000:=0 0 1\nDWMRI_b-value:=1000",
        "# spacings: 9 9 9",
    ],
)
def test_nrrd(tmp_path, line):
    def write(name, extra):
        text = (
            "NRRD0005\ntype: short\ndimension: 3\nspace: LPS\nsizes: 5 4 3\nspace origin: (1,2,3)\n"
            f"space directions: (2,0,0) (0,3,0) (0,0,4)\nencoding: raw\nendian: little\n{extra}\n"
        )
        (tmp_path / name).write_bytes(text.encode() + VALUES.tobytes())
        return tmp_path / name

    right, volume = read(write("a.nrrd", "")), read(write("b.nrrd", f"{line}\n"))
    assert right.warnings == ()
    assert_same(volume, right)


@pytest.mark.parametrize(
    "line",
    [
        "ElementNBits = 8",
        "CompressedDataSize = 7",
        "ObjectSubType = HDF5",
        "ElementMin = -5\nElementMax = 9",
        "Modality = MET_MOD_PET\nSequenceID = 1 2 3",
        "Name = um\nComment = ElementSpacing is 9\nColor = 1 0 0 1\nID = 3\nParentID = 2",
        "CenterOfRotation = 5 6 7",
        "ElementSize = 9 9 9",
    ],
)
def test_metaimage(tmp_path, line):
    def write(name, extra):
        text = (
            "ObjectType = Image\nNDims = 3\nDimSize = 5 4 3\nElementSpacing = 2 3 4\nOffset = 5 6 7\n"
            f"{extra}ElementType = MET_SHORT\nElementDataFile = LOCAL\n"
        )
        (tmp_path / name).write_bytes(text.encode() + VALUES.tobytes())
        return tmp_path / name

    right, volume = read(write("a.mha", "")), read(write("b.mha", f"{line}\n"))
    assert right.warnings == ()
    assert_same(volume, right)


@pytest.mark.parametrize("write", [netcdf, hdf])
@pytest.mark.parametrize("spacetype", ["native____", "talairach_", "callosal__", "um"])
def test_minc(tmp_path, write, spacetype):
    pytest.importorskip("h5py")
    right = read(write(tmp_path / "a.mnc", VALUES, 0.0, 1.0))
    assert right.warnings == ()
    assert_same(read(write(tmp_path / "b.mnc", VALUES, 0.0, 1.0, spacetype=spacetype)), right)


def test_mgh(tmp_path):
    path = write_mgh(tmp_path / "a.mgh", VALUES)
    right = read(path)
    for place, content in [(24, struct.pack(">i", 7)), (284 + VALUES.nbytes, struct.pack(">5f", *[9e9] * 5))]:
        changed(path, place, content)
    with path.open("ab") as file:
        file.write(b"\0\0\0\1talairach.xfm and other tags")
    assert right.warnings == ()
    assert_same(read(path), right)


@pytest.mark.parametrize(
    "fields",
    [
        {"ORIENT_SPECIFIC": (1, 2, 5)},
        {"ORIGIN": (9.0, 9.0, 9.0)},
        {"IJK_TO_DICOM": (9.0,) * 12},
        {"VOLREG_MATVEC_000000": (9.0,) * 12, "WARP_DATA": (9.0,) * 30},
        {"SCENE_DATA": (2, 3, 4, -999, -999, -999, -999, -999)},
        {"BRICK_STATS": (7.0, 8.0)},
        {"TAXIS_OFFSETS": (1.0, 2.0, 3.0)},
    ],
    ids=str,
)
def test_afni(tmp_path, fields):
    values = VALUES[None]
    right = read(write_afni(tmp_path, values))
    header = afni_header(values.shape[:0:-1], factors=(0.0,))
    for key, numbers in fields.items():
        kind = "integer" if all(isinstance(n, int) for n in numbers) else "float"
        told = f"type = {kind}-attribute\nname = {key}\ncount = {len(numbers)}\n"
        header = _without(header, key) + f"\n{told} {' '.join(map(str, numbers))}\n"
    header += "\ntype = string-attribute\nname = TEMPLATE_SPACE\ncount = 4\n'MNI~\n"
    (tmp_path / "a+orig.HEAD").write_text(header)
    assert right.warnings == ()
    assert_same(read(tmp_path / "a+orig.HEAD"), right)


def _without(header, key):
    """Return an AFNI header without an attribute."""
    blocks = header.split("\n\n")
    return "\n\n".join(block for block in blocks if f"= {key}\n" not in block)


@pytest.mark.parametrize(
    ("told", "instead"),
    [
        ("Repetition time [ms]               :   2000.000", "Repetition time [ms]               :   1.0"),
        ("Patient name                       :   phantom", "Patient name                       :   um"),
        ("Dynamic scan      <0=no 1=yes> ?   :   0", "Dynamic scan      <0=no 1=yes> ?   :   1"),
        (" 0.005 1070 1860 ", " 7.5 3 4 "),  # scale slope, window
        (" 39 0 1 1 7 ", " 40 0 1 1 9 "),
    ],
)
def test_parrec(tmp_path, told, instead):
    right = read(write_parrec(tmp_path, VALUES[None].astype("<u2")))
    header = par_header((5, 4, 3), same_scales(1, 3))
    assert told in header
    (tmp_path / "a.PAR").write_text(header.replace(told, instead))
    assert right.warnings == ()
    assert_same(read(tmp_path / "a.PAR"), right)


@pytest.mark.parametrize(
    "elements",
    [
        {"PatientPosition": "FFP", "Laterality": "L", "AnatomicalOrientationType": "QUADRUPED"},
        {"PixelSpacingCalibrationType": "FIDUCIAL"},
        {"RescaleType": "US", "PresentationLUTShape": "INVERSE"},
        {"WindowCenter": "40", "WindowWidth": "1", "VOILUTFunction": "SIGMOID"},
        {"SmallestImagePixelValue": 5, "LargestImagePixelValue": 3},
    ],
    ids=str,
)
def test_dicom(tmp_path, elements):
    right = read(save_stack(tmp_path / "a", axial()))
    assert right.warnings == ()
    assert_same(read(save_stack(tmp_path / "b", axial(), **elements)), right)


@pytest.mark.parametrize(
    "attributes",
    [
        {"units": "um"},
        {"interpretation": "image", "long_name": "um"},
    ],
    ids=str,
)
def test_hdf5(tmp_path, attributes):
    h5py = pytest.importorskip("h5py")

    def write(name, more):
        with h5py.File(tmp_path / name, "w") as file:
            file["a"] = VALUES
            file["a"].attrs.update({"element_size_um": [4.0, 3.0, 2.0], **more})
        return tmp_path / name

    right, volume = read(write("a.h5", {})), read(write("b.h5", attributes))
    np.testing.assert_allclose(right.spacing, (0.002, 0.003, 0.004))
    assert_same(volume, right)


def test_images(tmp_path):
    images = pytest.importorskip("PIL.Image")
    png = pytest.importorskip("PIL.PngImagePlugin")
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        for k, plane in enumerate(VALUES.astype("u1")):
            text = png.PngInfo()
            text.add(b"gAMA", struct.pack(">I", 45455))
            text.add_text("Comment", "pixel size 9 um")
            more = {"pnginfo": text, "icc_profile": b"profile"} if folder == "b" else {}
            images.fromarray(plane).save(tmp_path / folder / f"s{k}.png", **more)
    assert_same(read(tmp_path / "b"), read(tmp_path / "a"))


@pytest.mark.parametrize(
    "told",
    [
        {"TimeIncrement": 5, "TimeIncrementUnit": "s"},
        {"SignificantBits": 12},
        {"Plane": {"PositionX": [9.0] * 3, "PositionXUnit": ["mm"] * 3, "PositionY": [8.0] * 3}},
    ],
    ids=str,
)
def test_tiff(tmp_path, told):
    tifffile = pytest.importorskip("tifffile")
    lengths = {f"PhysicalSize{axis}": size for axis, size in zip("XYZ", (2, 3, 4), strict=True)}
    for name, more in (("a", {}), ("b", told)):
        metadata = {"axes": "ZYX", **lengths, **more}
        tifffile.imwrite(tmp_path / f"{name}.ome.tif", VALUES, metadata=metadata, photometric="minisblack")
    right = read(tmp_path / "a.ome.tif")
    assert right.warnings == ()
    assert_same(read(tmp_path / "b.ome.tif"), right)


def test_imagej(tmp_path):
    tifffile = pytest.importorskip("tifffile")
    for name, more in (("a", {}), ("b", {"finterval": 0.5, "min": 3.0, "max": 5.0, "loop": True})):
        metadata = {"axes": "ZYX", "spacing": 4, "unit": "um", **more}
        tifffile.imwrite(tmp_path / f"{name}.tif", VALUES.astype("u2"), imagej=True, metadata=metadata)
    assert_same(read(tmp_path / "b.tif"), read(tmp_path / "a.tif"))


def test_imagej_slices_in_a_folder(tmp_path):
    tifffile = pytest.importorskip("tifffile")
    for folder, more in (("a", {}), ("b", {"xorigin": 3.0, "yorigin": 2.0, "zorigin": 1.0})):
        (tmp_path / folder).mkdir()
        for k, plane in enumerate(VALUES.astype("u2")):
            metadata = {"axes": "YX", "spacing": 4, "unit": "um", **more}
            tifffile.imwrite(tmp_path / folder / f"s{k}.tif", plane, imagej=True, metadata=metadata)
    assert_same(read(tmp_path / "b"), read(tmp_path / "a"))
