"""Give the tests of HDF5 a path."""

import pytest


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.h5"
