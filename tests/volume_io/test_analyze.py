import nibabel as nib
import numpy as np
import pytest

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError, VolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes
from tests.volume_io.reading import counting, physical, read


def write(path, values, **fields):
    """Save values [k, j, i] as an SPM2 pair, which is Analyze with a scale factor."""
    image = nib.Spm2AnalyzeImage(values.T, np.diag([2, 3, 4, 1]))
    for key, value in fields.items():
        image.header[key] = value
    nib.save(image, path)
    return path


@pytest.mark.parametrize("dtype", ["u1", "<i2", "<i4", "<f4", "<f8"])
@pytest.mark.parametrize("suffix", [".hdr", ".img"])
def test_every_type_from_either_file(tmp_path, dtype, suffix):
    values = counting((3, 4, 5), dtype)
    write(tmp_path / "a.img", values)
    volume = read(tmp_path / f"a{suffix}")
    np.testing.assert_array_equal(volume.values, values)
    np.testing.assert_array_equal(volume.affine, np.diag([2, 3, 4, 1]))
    assert (volume.space, volume.format) == ("none", "analyze")
    assert "left may be right" in volume.sentences[0]


def test_a_real_gzipped_big_endian_pair_agrees_with_nibabel(shared_data):
    path = shared_data / "analyze_mni/avg152T1.img.gz"
    volume = read(path)
    with np.errstate(all="ignore"):
        expected = np.asarray(nib.load(path).dataobj)[..., 0].T
    np.testing.assert_allclose(physical(volume), expected, rtol=1e-6)
    np.testing.assert_array_equal(read(shared_data / "analyze_mni/avg152T1.hdr.gz").values, volume.values)


def test_a_truncated_pair_is_refused(tmp_path):
    path = write(tmp_path / "a.img", counting((3, 4, 5)))
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(DamagedVolumeError, match="119 bytes found, 120 expected"):
        read(path)
    path.unlink()
    with pytest.raises(VolumeError, match=r"a\.img"):
        read(tmp_path / "a.hdr")


def test_other_headers_are_refused(tmp_path):
    (tmp_path / "a.hdr").write_bytes(b"ENVI\nsamples = 4\n")
    (tmp_path / "a.img").write_bytes(bytes(100))
    with pytest.raises(UnsupportedFormatError):
        read(tmp_path / "a.hdr")
    with pytest.raises(UnsupportedFormatError, match="no Analyze header"):
        read(tmp_path / "a.hdr", input_format="analyze")


@pytest.mark.parametrize(
    ("unit", "scale", "codes"),
    [
        (b"", 1, []),
        (b"mm", 1, []),
        (b"um", 1e-3, []),
        (b"cm", 10, []),
        (b"vox", 1, ["W-UNIT-UNKNOWN"]),
        (b"???", 1, ["W-UNIT-MISSING"]),
    ],
)
def test_the_unit_of_the_header(tmp_path, unit, scale, codes):
    path = write(tmp_path / "a.img", counting((3, 4, 5)), vox_units=unit)
    volume = read(path)
    np.testing.assert_allclose(volume.spacing, np.array([2, 3, 4]) * scale, rtol=1e-12)
    assert [notice.code for notice in volume.warnings] == ["W-ORIENTATION-MISSING", *codes]
    given = read(path, spacing=(1, 2, 3))
    assert given.spacing == ((1, 2, 3) if codes else volume.spacing)


def test_the_fourth_axis_is_time(tmp_path):
    values = counting((3, 4, 5, 6), "<i2")
    path = write(tmp_path / "a.img", values)
    np.testing.assert_array_equal(read(path, time="2").values, values[2])
    np.testing.assert_array_equal(read(path, volume_index=1).values, values[1])
    assert list_volumes(str(path), ReadSettings())[0].volumes[2] == "time 2, 6 x 5 x 4"


def test_negative_distances_are_told_and_turn_nothing(tmp_path):
    path = write(tmp_path / "a.img", counting((3, 4, 5)))
    header = bytearray((tmp_path / "a.hdr").read_bytes())
    header[80:84] = np.array(-2, "<f4").tobytes()
    (tmp_path / "a.hdr").write_bytes(header)
    volume = read(path)
    np.testing.assert_array_equal(volume.affine, np.diag([2, 3, 4, 1]))
    assert [notice.code for notice in volume.warnings] == ["W-ORIENTATION-MISSING", "W-GEOMETRY-CONTRADICTED"]
