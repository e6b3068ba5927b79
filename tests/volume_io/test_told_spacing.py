"""Spacing and origin come from the file; where it tells none a warning says so, and the options give them."""

import numpy as np
import pytest

from tests.volume_io.nrrd.test_reader import LPS, header as nrrd_header
from tests.volume_io.reading import counting, read
from tests.volume_io.test_metaimage import header as meta_header

VALUES = counting((4, 3, 2))


def silent_file(folder, suffix):
    """Write VALUES in a file that tells neither spacing nor origin."""
    path = folder / f"a{suffix}"
    if suffix == ".npy":
        np.save(path, VALUES)
    elif suffix == ".npz":
        np.savez(path, VALUES)
    else:
        header = nrrd_header() + "\n" if suffix == ".nrrd" else meta_header()
        path.write_bytes(header.encode() + VALUES.tobytes())
    return path


@pytest.mark.parametrize(
    ("suffix", "space"), [(".npy", "none"), (".npz", "none"), (".nrrd", "none"), (".mha", "LPS")]
)
def test_a_file_without_spacing(tmp_path, suffix, space):
    path = silent_file(tmp_path, suffix)
    volume = read(path)
    assert volume.sentences == ("the file tells no spacing; 1 mm is taken; --spacing gives it",)
    np.testing.assert_array_equal(volume.affine, np.eye(4))
    given = read(path, spacing=(1, 2, 3), origin=(4, 5, 6))
    assert given.sentences == ()
    np.testing.assert_array_equal(given.affine, [[1, 0, 0, 4], [0, 2, 0, 5], [0, 0, 3, 6], [0, 0, 0, 1]])
    assert volume.space == given.space == space
    assert read(path, spacing=(1, 1, 1)).sentences == ()


@pytest.mark.parametrize(
    ("suffix", "header"),
    [
        (".nrrd", nrrd_header(extra=LPS) + "\n"),
        (".nrrd", nrrd_header(extra="spacings: 2 3 4\naxis mins: 7 8 9\nunits: mm mm mm\n") + "\n"),
        (".nrrd", nrrd_header(extra="axis mins: 7 8 9\naxis maxs: 9 14 21\nunits: mm mm mm\n") + "\n"),
        (".mha", meta_header(extra="ElementSpacing = 2 3 4\nOffset = 7 8 9\n")),
        (".mha", meta_header(extra="ElementSize = 2 3 4\nPosition = 7 8 9\n")),
    ],
)
def test_a_file_s_own_spacing_and_origin_go_before_the_options(tmp_path, suffix, header):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(header.encode() + VALUES.tobytes())
    volume, given = read(path), read(path, spacing=(1, 1, 1), origin=(0, 0, 0))
    assert volume.sentences == ()
    assert given.sentences == tuple(
        f"--{option} has no effect: the file tells its own" for option in ("spacing", "origin")
    )
    for found in (volume, given):
        np.testing.assert_array_equal(found.affine, [[2, 0, 0, 7], [0, 3, 0, 8], [0, 0, 4, 9], [0, 0, 0, 1]])


def test_an_origin_may_stand_alone(tmp_path):
    path = tmp_path / "a.nrrd"
    text = nrrd_header(extra="axis mins: 7 8 9\ncenterings: cell node node\n") + "\n"
    path.write_bytes(text.encode() + VALUES.tobytes())
    volume = read(path, spacing=(2, 3, 4))
    assert volume.sentences == ()
    np.testing.assert_array_equal(volume.affine, [[2, 0, 0, 8], [0, 3, 0, 8], [0, 0, 4, 9], [0, 0, 0, 1]])
