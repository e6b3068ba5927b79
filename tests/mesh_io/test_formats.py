"""The registry of formats of meshes: every one is written and read."""

import numpy as np
import pytest

from dmc_cli.mesh_formats import FORMATS, known_suffixes
from dmc_cli.mesh_io.read import read_mesh
from dmc_cli.mesh_io.write import write_mesh


@pytest.mark.parametrize("name", FORMATS)
def test_what_is_written_is_read_again(name, cube, tmp_path):
    path = str(tmp_path / f"a{FORMATS[name].suffix}")
    assert write_mesh(path, cube).format == name
    found = read_mesh(path)
    np.testing.assert_array_equal(found.points, cube.points)
    np.testing.assert_array_equal(found.faces, cube.faces)


def test_no_suffix_means_two_formats():
    assert len(known_suffixes()) == len(set(known_suffixes()))
