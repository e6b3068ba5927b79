"""Pairs and detached headers of which the header, the values or both are packed."""

import gzip
import itertools

import nibabel as nib
import numpy as np
import pytest

from dmc_cli.errors import DamagedVolumeError, UnsupportedFormatError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io import decoding, packed
from dmc_cli.volume_io.read import list_volumes
from tests.volume_io.afni_files import afni_header
from tests.volume_io.par_files import par_header
from tests.volume_io.reading import counting, read
from tests.volume_io.test_packed import PACKERS

VALUES = counting((3, 4, 5), "<i2")

NRRD = "NRRD0004\ntype: short\ndimension: 3\nsizes: 5 4 3\nencoding: {}\nendian: little\ndata file: {}\n"
META = "NDims = 3\nDimSize = 5 4 3\nElementType = MET_SHORT\nElementDataFile = {}\n"


def analyze(folder):
    nib.save(nib.Spm2AnalyzeImage(VALUES.T, np.diag([2, 3, 4, 1])), folder / "a.img")
    return folder / "a.hdr", folder / "a.img"


def nifti(folder):
    nib.save(nib.Nifti1Pair(VALUES.T, np.diag([2, 3, 4, 1])), folder / "a.img")
    return folder / "a.hdr", folder / "a.img"


def afni(folder):
    (folder / "a+orig.HEAD").write_text(afni_header((5, 4, 3)))
    (folder / "a+orig.BRIK").write_bytes(VALUES.tobytes())
    return folder / "a+orig.HEAD", folder / "a+orig.BRIK"


def parrec(folder):
    (folder / "a.PAR").write_text(par_header((5, 4, 3), [[[1, 0]] * 3]))
    (folder / "a.REC").write_bytes(VALUES.tobytes())
    return folder / "a.PAR", folder / "a.REC"


PAIRS = [analyze, nifti, afni, parrec]


def pack(path, suffix):
    """Replace a file by what packs it; without a suffix it stays."""
    if suffix:
        path.with_name(path.name + suffix).write_bytes(PACKERS[suffix](path.read_bytes()))
        path.unlink()
    return path.with_name(path.name + suffix)


def assert_same(volume, plain):
    np.testing.assert_array_equal(volume.values, plain.values)
    np.testing.assert_array_equal(volume.affine, plain.affine)
    assert (volume.format, volume.space, volume.warnings) == (plain.format, plain.space, plain.warnings)


@pytest.mark.parametrize("maker", PAIRS)
@pytest.mark.parametrize(("head", "data"), [*itertools.product([*PACKERS, ""], repeat=2)])
def test_either_part_of_a_pair_may_be_packed(tmp_path, maker, head, data):
    header, values = maker(tmp_path)
    plain = read(header)
    header, values = pack(header, head), pack(values, data)
    for given in (header, values):
        assert_same(read(given), plain)
        (entry,) = list_volumes(str(given), ReadSettings())
        assert entry.size == plain.shape
    assert set(read(header).files) <= {header, values}


@pytest.mark.parametrize("maker", PAIRS)
def test_a_folder_of_a_packed_pair_is_one_volume(tmp_path, maker):
    header, values = maker(tmp_path)
    plain = read(header)
    pack(header, ".gz")
    pack(values, ".xz")
    assert_same(read(tmp_path), plain)


def nrrd(folder, named, encoding="raw"):
    (folder / "a.nhdr").write_text(NRRD.format(encoding, named))
    return folder / "a.nhdr"


def meta(folder, named):
    (folder / "a.mhd").write_text(META.format(named))
    return folder / "a.mhd"


@pytest.mark.parametrize("header", [nrrd, meta])
@pytest.mark.parametrize("suffix", PACKERS)
@pytest.mark.parametrize("head", ["", ".gz", ".bz2"])
def test_data_of_a_detached_header_may_be_packed(tmp_path, header, suffix, head):
    (tmp_path / "a.raw").write_bytes(VALUES.tobytes())
    packed_data = pack(tmp_path / "a.raw", suffix)
    path = pack(header(tmp_path, packed_data.name), head)
    np.testing.assert_array_equal(read(path).values, VALUES)
    assert packed_data in read(path).files


@pytest.mark.parametrize("header", [nrrd, meta])
@pytest.mark.parametrize("suffix", PACKERS)
@pytest.mark.parametrize("named", ["s%d.raw{} 0 2 1", "LIST\ns0.raw{0}\ns1.raw{0}\ns2.raw{0}"])
def test_slices_of_a_detached_header_may_be_packed(tmp_path, header, suffix, named):
    for k, plane in enumerate(VALUES):
        (tmp_path / f"s{k}.raw").write_bytes(plane.tobytes())
        pack(tmp_path / f"s{k}.raw", suffix)
    np.testing.assert_array_equal(read(header(tmp_path, named.format(suffix))).values, VALUES)


@pytest.mark.parametrize("suffix", PACKERS)
def test_the_packing_is_that_of_the_data_not_of_the_header(tmp_path, suffix):
    (tmp_path / "a.raw").write_bytes(VALUES.tobytes())
    path = nrrd(tmp_path, pack(tmp_path / "a.raw", suffix).name, "gzip")
    np.testing.assert_array_equal(read(path).values, VALUES)


def test_data_that_only_look_packed_are_raw(tmp_path):
    """Whatever their first values are, and as long as their length is that of raw ones."""
    values = VALUES.copy()
    for start in packed.MAGICS.values():
        content = bytearray(values.tobytes())
        content[: len(start)] = start
        header, data = analyze(tmp_path)
        data.write_bytes(content)
        assert read(header).values.tobytes() == content
        (tmp_path / "a.raw").write_bytes(content)
        assert read(nrrd(tmp_path, "a.raw")).values.tobytes() == content


def test_packed_data_of_any_name_are_known_by_their_length(tmp_path):
    values = np.zeros((30, 40, 50), "<i2")
    values[3:9] = 5
    for suffix, packer in PACKERS.items():
        (tmp_path / f"a{suffix[1:]}").write_bytes(packer(values.tobytes()))
        path = nrrd(tmp_path, f"a{suffix[1:]}")
        path.write_text(path.read_text().replace("5 4 3", "50 40 30"))
        np.testing.assert_array_equal(read(path).values, values)


def test_an_attached_header_of_a_detached_name_is_read_packed(tmp_path):
    text = NRRD.format("raw", "").replace("data file: \n", "\n")
    (tmp_path / "a.nhdr.gz").write_bytes(gzip.compress(text.encode() + VALUES.tobytes()))
    np.testing.assert_array_equal(read(tmp_path / "a.nhdr.gz").values, VALUES)


@pytest.mark.parametrize("change", ["line skip: 1", "byte skip: -1"])
def test_skips_that_have_no_place_in_packed_data_are_refused(tmp_path, change):
    (tmp_path / "a.raw").write_bytes(b"a line\n" + VALUES.tobytes())
    path = nrrd(tmp_path, pack(tmp_path / "a.raw", ".bz2").name)
    path.write_text(path.read_text() + change + "\n")
    with pytest.raises(DamagedVolumeError, match=r"a\.raw\.bz2.*packed by bzip2.*unpack"):
        read(path)


def test_data_beside_a_packed_header_that_are_not_there_are_told(tmp_path):
    path = pack(nrrd(tmp_path, "a.raw"), ".gz")
    with pytest.raises(Exception, match=r"its data file 'a\.raw' is not there"):
        read(path)


def test_the_package_that_unpacks_data_is_named_where_it_is_missing(tmp_path, monkeypatch):
    (tmp_path / "a.raw").write_bytes(VALUES.tobytes())
    path = nrrd(tmp_path, pack(tmp_path / "a.raw", ".zst").name)
    monkeypatch.setattr(decoding, "_knows_zstd", lambda: False)
    with pytest.raises(UnsupportedFormatError, match=r"pip install \"dmc-cli\[zstd\]\""):
        read(path)


@pytest.mark.parametrize("suffix", PACKERS)
def test_packed_values_that_are_cut_are_refused(tmp_path, suffix):
    header, data = parrec(tmp_path)
    data.write_bytes(np.random.default_rng(0).bytes(VALUES.nbytes))
    whole = pack(data, suffix)
    whole.write_bytes(whole.read_bytes()[:-40])
    with pytest.raises(DamagedVolumeError, match=r"a\.PAR"):
        read(header)
