"""What Siemens keeps in a header of its own: mosaics taken apart, b-values and directions."""

import struct
import warnings

import numpy as np
import pytest
from pydicom import uid

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, VolumeError
from tests.volume_io.dicom.scanner import axial, make_slice, plane_values, save
from tests.volume_io.dicom.test_kinds import words
from tests.volume_io.reading import physical, read

MOSAIC = ["ORIGINAL", "PRIMARY", "M", "NORM", "MOSAIC"]
OBLIQUE = (0.0, 1.0, 0.0, -0.6, 0.0, -0.8)


def csa(fields, version=2):
    """A CSA header of fields, each a list of texts."""
    kinds = {"NumberOfImagesInMosaic": b"US", "B_value": b"IS", "AcquisitionMatrixText": b"SH"}
    # the first one of real headers of version 1 is empty
    found = struct.pack("<II", len(fields) + 1, 77) + struct.pack("<64si4s3i", b"empty", 0, b"IS", 0, 0, 77)
    for name, values in fields.items():
        kind = kinds.get(name, b"FD")
        found += struct.pack("<64si4s3i", name.encode(), len(values), kind, 0, 6, 77)
        for n in range(6):
            text = values[n].encode() + b"\0" if n < len(values) else b""
            # lengths of version 1 are too large by the number of items
            length = len(text) if version == 2 else len(text) + 6
            found += struct.pack("<4i", length, len(text), 77, length) + text + b"\0" * (-len(text) % 4)
    return b"SV10\4\3\2\1" + found if version == 2 else found


def with_csa(dataset, fields, version=2, block=0x10):
    dataset.add_new(0x00290000 | block, "LO", "SIEMENS CSA HEADER")
    dataset.add_new(0x00290000 | block << 8 | 0x10, "OB", csa(fields, version))
    return dataset


def mosaic(planes, *, ascends=True, orientation=OBLIQUE, version=2, told=True, **elements):
    """Planes as the tiles of one image; the header tells how many, and the normal."""
    across = int(np.ceil(np.sqrt(len(planes))))
    rows, columns = planes.shape[1:]
    image = np.zeros((across * rows, across * columns), planes.dtype)
    for n, plane in enumerate(planes):
        row, column = divmod(n, across)
        image[row * rows : (row + 1) * rows, column * columns : (column + 1) * columns] = plane
    normal = np.cross(orientation[:3], orientation[3:]) * (1 if ascends else -1)
    numbers = {"ImageType": MOSAIC, "Modality": "MR", "SpacingBetweenSlices": "3.5", **elements}
    dataset = make_slice((10, 20, 30), 1, values=image, orientation=orientation, **numbers)
    fields = {"SliceNormalVector": [f"{x:.8f}" for x in normal]}
    if told:
        fields["AcquisitionMatrixText"] = [f"{rows}*{columns}"]
        fields["NumberOfImagesInMosaic"] = [str(len(planes))]
    return with_csa(dataset, fields, version)


def random_planes(count=11, shape=(6, 8)):
    return np.random.default_rng(count).integers(0, 4000, (count, *shape)).astype("<u2")


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize("ascends", [True, False])
def test_a_mosaic_is_taken_apart_as_nibabel_does(tmp_path, ascends, version):
    planes = random_planes()
    path = save(mosaic(planes, ascends=ascends, version=version), tmp_path / "a")
    volume = read(path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from nibabel.nicom.dicomwrappers import wrapper_from_file
    expected = wrapper_from_file(path)
    assert expected.is_mosaic
    order = slice(None) if ascends else slice(None, None, -1)
    np.testing.assert_array_equal(volume.values, planes[order])
    # nibabel's axes are rows, columns, slices
    affine = expected.affine[:, [1, 0, 2, 3]] @ (np.eye(4) if ascends else flipped(len(planes)))
    np.testing.assert_allclose(volume.affine, affine, atol=1e-6)
    np.testing.assert_allclose(np.transpose(expected.get_data(), (2, 0, 1))[order], physical(volume))


def flipped(count):
    """Slices in the other order."""
    matrix = np.diag([1.0, 1, -1, 1])
    matrix[2, 3] = count - 1
    return matrix


@pytest.mark.parametrize("syntax", [uid.ImplicitVRLittleEndian, uid.RLELossless])
def test_mosaics_of_times_are_volumes(tmp_path, syntax):
    volumes = [random_planes(9) + np.uint16(n) for n in range(3)]
    for n, planes in enumerate(volumes):
        dataset = mosaic(planes, AcquisitionNumber=str(n + 1), PixelRepresentation=0, told=False)
        dataset.add_new(0x00190010, "LO", "SIEMENS MR HEADER")
        dataset.add_new(0x0019100A, "US", 9)
        dataset.file_meta.TransferSyntaxUID = syntax
        if syntax == uid.RLELossless:
            dataset.file_meta.TransferSyntaxUID = uid.ExplicitVRLittleEndian
            dataset.compress(syntax)
        save(dataset, tmp_path / str(n))
    assert words(tmp_path) == [f"acquisition {n}" for n in (1, 2, 3)]
    np.testing.assert_array_equal(read(tmp_path, series="2").values, volumes[1])


@pytest.mark.parametrize(
    ("change", "error", "told"),
    [
        ({"fields": {}}, VolumeError, "does not tell how many"),
        ({"fields": {"NumberOfImagesInMosaic": ["11"]}}, VolumeError, "SliceNormalVector is missing"),
        ({"SpacingBetweenSlices": None}, VolumeError, "SpacingBetweenSlices is missing"),
        ({"count": "30"}, DamagedVolumeError, "expected a multiple of 6 for its 30 slices"),
        ({"normal": ["1", "0", "0"]}, DamagedVolumeError, "is no normal of its directions"),
    ],
)
def test_a_mosaic_that_does_not_tell_how_its_slices_lie_is_refused(tmp_path, change, error, told):
    elements = {key: value for key, value in change.items() if key[0].isupper()}
    dataset = mosaic(random_planes(shape=(7, 8)), orientation=(1, 0, 0, 0, 1, 0), **elements)
    fields = {
        "NumberOfImagesInMosaic": [change.get("count", "11")],
        "SliceNormalVector": change.get("normal", ["0", "0", "1"]),
    }
    with_csa(dataset, change.get("fields", fields))
    with pytest.raises(error, match=told):
        read(save(dataset, tmp_path / "a"))


def test_a_csa_header_cut_anywhere_is_no_traceback(tmp_path):
    dataset = mosaic(random_planes())
    content = dataset[0x00291010].value
    for kept in range(0, len(content), 61):
        dataset[0x00291010].value = content[:kept] + b"\0" * (kept % 2)
        with pytest.raises(VolumeError, match="does not tell how"):
            read(save(dataset, tmp_path / "a"))


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize("block", [0x10, 0x11])
def test_b_values_and_directions_of_the_csa_header_tell_images_apart(tmp_path, version, block):
    told = [("0", None), ("1000", (1.0, 0, 0)), ("1000", (0, 0.6, 0.8))]
    for n, (b_value, direction) in enumerate(told):
        fields = {"B_value": [b_value]}
        if direction:
            fields["DiffusionGradientDirection"] = [f"{x:.8f}" for x in direction]
        for k, position in enumerate(axial(3)):
            dataset = make_slice(position, k, values=plane_values(k + 10 * n))
            save(with_csa(dataset, fields, version, block), tmp_path / f"{(n * 7 + k * 5) % 23}")
    assert words(tmp_path) == [
        "b-value 0 s/mm2",
        "b-value 1000 s/mm2, gradient direction 0 0.6 0.8",
        "b-value 1000 s/mm2, gradient direction 1 0 0",
    ]
    np.testing.assert_array_equal(read(tmp_path, series="3").values, [plane_values(k + 10) for k in range(3)])


def test_a_csa_header_that_tells_nothing_leaves_copies_refused(tmp_path):
    for n in range(2):
        for k, position in enumerate(axial(3)):
            dataset = with_csa(make_slice(position, k, values=plane_values(k + 10 * n)), {"B_value": ["0"]})
            save(dataset, tmp_path / f"{n}{k}")
    with pytest.raises(AmbiguousVolumeError, match="lie where another one lies"):
        read(tmp_path)


def test_the_header_tests_write_is_one_that_nibabel_reads():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from nibabel.nicom import csareader
    for version in (1, 2):
        found = csareader.read(csa({"B_value": ["700"], "SliceNormalVector": ["0", "0", "1"]}, version))
        assert found["type"] == version
        assert found["tags"]["B_value"]["items"] == [700]
