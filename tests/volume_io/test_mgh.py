import gzip

import nibabel as nib
import numpy as np
import pytest
from hypothesis import given, strategies as st

from dmc_cli.errors import (
    AmbiguousVolumeError,
    DamagedVolumeError,
    SettingsError,
    UnsupportedFormatError,
    VolumeError,
)
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes
from tests.volume_io.reading import assert_same_as_nibabel, counting, nibabels_own, read

OBLIQUE = np.array([[0.0, -1.5, 0.2, 5], [0.8, 0, 0, -7], [0, 0.3, 2.5, 9], [0, 0, 0, 1]])


def write(path, values, affine=OBLIQUE):
    content = nib.MGHImage(values.T, affine).to_bytes()
    path.write_bytes(gzip.compress(content) if path.suffix == ".mgz" else content)
    return path


def loaded(path):
    """Load the whole image with nibabel, whose load() leaves the file open."""
    content = path.read_bytes()
    return nib.MGHImage.from_bytes(gzip.decompress(content) if path.suffix == ".mgz" else content)


def changed(path, place, content):
    start = bytearray(path.read_bytes())
    start[place : place + len(content)] = content
    path.write_bytes(start)
    return path


@pytest.mark.parametrize("dtype", ["u1", "i2", "i4", "f4", "u2"])
@pytest.mark.parametrize("suffix", [".mgh", ".mgz"])
def test_every_type_agrees_with_nibabel(tmp_path, dtype, suffix):
    path = write(tmp_path / f"a{suffix}", counting((3, 4, 5), dtype))
    volume = read(path)
    assert_same_as_nibabel(volume, loaded(path))
    assert (volume.values.dtype, volume.format) == (np.dtype(dtype), "mgh")


@given(shape=st.tuples(*[st.integers(2, 6)] * 3), seed=st.integers(0, 99))
def test_any_affine_agrees_with_nibabel(tmp_path_factory, shape, seed):
    affine = np.eye(4)
    affine[:3] = np.random.default_rng(seed).normal(size=(3, 4))
    path = write(tmp_path_factory.mktemp("mgh") / "a.mgz", counting(shape), affine)
    assert_same_as_nibabel(read(path), loaded(path))


def test_a_frame_of_several_is_chosen_by_its_index(tmp_path):
    path = write(tmp_path / "a.mgz", counting((3, 4, 5, 6)))
    with pytest.raises(AmbiguousVolumeError, match=r"3 volumes found.*--volume-index"):
        read(path)
    for index in range(3):
        assert_same_as_nibabel(read(path, volume_index=index), loaded(path), index)


def test_a_frame_is_a_time(tmp_path):
    path = write(tmp_path / "a.mgz", counting((3, 4, 5, 6)))
    assert_same_as_nibabel(read(path, time="2"), loaded(path), 2)
    assert list_volumes(str(path), ReadSettings())[0].volumes[2] == "time 2, 6 x 5 x 4"
    with pytest.raises(SettingsError, match="has no such axis"):
        read(path, channel="1")


def test_without_orientation_it_is_freesurfers_and_told(tmp_path):
    path = changed(write(tmp_path / "a.mgh", counting((3, 4, 5))), 28, b"\0\0")
    volume = read(path)
    assert_same_as_nibabel(volume, loaded(path))
    assert "goodRASFlag is 0" in volume.sentences[0]


def test_the_content_tells_the_format(tmp_path):
    path = write(tmp_path / "a.mgz", counting((3, 4, 5)))
    assert read(path.rename(tmp_path / "a.bin")).format == "mgh"


@pytest.mark.parametrize(
    ("place", "content", "told"),
    [
        (0, b"\0\0\0\2", "no MGH header found"),
        (4, b"\xff\xff\xff\xff", "expected positive numbers"),
        (16, b"\0\0\0\0", "expected positive numbers"),
        (4, b"\0\1\0\0\0\1\0\0\0\1\0\0", "bytes found"),
        (4, b"\x7f\xff\xff\xff" * 4, "bytes found"),
        (20, b"\0\0\0\2", "type code 2 found"),
        (30, b"\x7f\xc0\0\0", "not finite"),
        (42, bytes(36), "span the space"),
    ],
    ids=str,
)
def test_headers_that_cannot_be(tmp_path, place, content, told):
    path = changed(write(tmp_path / "a.mgh", counting((3, 4, 5))), place, content)
    with pytest.raises(VolumeError, match=told) as caught:
        read(path, volume_index=0)
    assert caught.value.exit_status == 3


@pytest.mark.parametrize("kept", [3, 100, 283, 284, 300, 403])
@pytest.mark.parametrize("suffix", [".mgh", ".mgz"])
def test_a_truncated_file_is_refused(tmp_path, kept, suffix):
    content = write(tmp_path / "a.mgh", counting((3, 4, 5))).read_bytes()[:kept]
    cut = tmp_path / f"cut{suffix}"
    cut.write_bytes(gzip.compress(content) if suffix == ".mgz" else content)
    with pytest.raises((DamagedVolumeError, UnsupportedFormatError)):
        read(cut)


def test_nibabels_own_file():
    path = nibabels_own("test.mgz")
    for index in range(loaded(path).shape[3]):
        assert_same_as_nibabel(read(path, volume_index=index), loaded(path), index)
