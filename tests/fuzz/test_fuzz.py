import random
from pathlib import Path

import pytest
from hypothesis import given, settings, strategies as st

from dmc_cli.errors import DmcError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import read_volume
from tests.fuzz.honest import HONEST
from tests.fuzz.mutation import mutated
from tests.fuzz.trial import settings_for, target_of, try_file

NEEDED = {
    "compressed": ("openjpeg", "jpeg_ls"),
    "hdf5": ("h5py",),
    "hdf5_meanings": ("h5py",),
    "images": ("PIL", "openjpeg"),
    "minc": ("h5py",),
    "tiff": ("tifffile",),
    "tiff_logs": ("tifffile",),
    "zarr": ("zarr",),
}
"""The packages that a reader needs."""

CRASHERS = sorted((Path(__file__).parent / "crashers").glob("*-*"))


@pytest.fixture(scope="module")
def honest(tmp_path_factory):
    """Paths and contents of a reader's honest files, made once."""
    made = {}

    def make(reader):
        if reader not in made:
            for package in NEEDED.get(reader, ()):
                pytest.importorskip(package)
            paths = HONEST[reader](tmp_path_factory.mktemp(reader))
            made[reader] = [(path, path.read_bytes()) for path in paths]
        return made[reader]

    return make


@pytest.mark.parametrize("reader", HONEST)
def test_honest_files_are_read(honest, reader):
    for path, _ in honest(reader):
        chosen = settings_for(reader)
        if path.name in ("four.nrrd", "a.npz"):
            chosen = ReadSettings(volume_index=0)
        read_volume(str(target_of(path, reader)), chosen)


@pytest.mark.parametrize("reader", HONEST)
@settings(max_examples=50)
@given(which=st.integers(0, 99), seed=st.integers(0, 2**32))
def test_damaged_files_give_documented_errors_only(honest, reader, which, seed):
    assert_documented(honest, reader, which, seed)


@pytest.mark.slow
@pytest.mark.parametrize("reader", HONEST)
@settings(max_examples=500)
@given(which=st.integers(0, 99), seed=st.integers(0, 2**32))
def test_many_damaged_files_give_documented_errors_only(honest, reader, which, seed):
    assert_documented(honest, reader, which, seed)


def assert_documented(honest, reader, which, seed):
    """Fail if a file, damaged as the seed has it, gives anything but a volume or an error of ours."""
    files = honest(reader)
    path, content = files[which % len(files)]
    path.write_bytes(mutated(content, random.Random(seed)))
    try:
        try_file(path, reader)
    finally:
        path.write_bytes(content)


@pytest.mark.parametrize("path", CRASHERS, ids=lambda path: path.name)
def test_what_once_broke_a_reader_does_not_any_more(honest, path):
    reader, _, rest = path.name.partition("-")
    stem, _, tail = rest.rpartition("-")
    name = stem + Path(tail).suffix
    targets = [(target, content) for target, content in honest(reader) if target.name == name]
    assert targets
    for target, content in targets:
        target.write_bytes(path.read_bytes())
        try:
            try_file(target, reader)
        finally:
            target.write_bytes(content)


def test_damage_is_really_done(honest):
    (path, content), *_ = honest("nifti")
    outcomes = set()
    for seed in range(200):
        path.write_bytes(mutated(content, random.Random(seed)))
        try:
            read_volume(str(path), ReadSettings())
            outcomes.add("read")
        except DmcError as error:
            outcomes.add(type(error).__name__)
    path.write_bytes(content)
    assert {"read", "DamagedVolumeError", "UnsupportedFormatError"} <= outcomes
