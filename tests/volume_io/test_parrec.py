import nibabel as nib
import numpy as np
import pytest
from hypothesis import given, strategies as st
from nibabel.parrec import PARRECHeader, PARRECImage

from dmc_cli.errors import (
    AmbiguousVolumeError,
    DamagedVolumeError,
    SettingsError,
    UnsupportedFormatError,
    VolumeError,
)
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import list_volumes
from tests.volume_io.par_files import par_header, same_scales
from tests.volume_io.reading import assert_same_as_nibabel, counting, nibabels_own, physical, read


def write(folder, values, scales=None, order=None, **changes):
    """Write volumes [t, k, j, i] as a pair and return the header's path."""
    scales = same_scales(*values.shape[:2]) if scales is None else scales
    header = par_header(values.shape[:0:-1], scales, order=order, **changes)
    (folder / "a.PAR").write_text(header)
    planes = values.reshape(-1, *values.shape[2:])
    stored = np.empty_like(planes)
    stored[list(order) if order is not None else slice(None)] = planes
    (folder / "a.REC").write_bytes(stored.tobytes())
    return folder / "a.PAR"


def loaded(path):
    """Load the whole image with nibabel, whose load() leaves a file open."""
    with path.open() as header, path.with_suffix(".REC").open("rb") as data:
        files = PARRECImage.make_file_map({"header": header, "image": data})
        image = PARRECImage.from_file_map(files, mmap=False, strict_sort=True)
        return nib.Nifti1Image(image.get_fdata(), image.affine)


@pytest.mark.parametrize(("bits", "dtype"), [(8, "u1"), (16, "<u2")])
def test_one_scale_keeps_the_stored_values(tmp_path, bits, dtype):
    values = counting((1, 3, 4, 5), dtype)
    path = write(tmp_path, values, same_scales(1, 3, 0.5, -2.0), bits=bits)
    volume = read(path)
    assert_same_as_nibabel(volume, loaded(path))
    np.testing.assert_array_equal(volume.values, values[0])
    assert (volume.slope, volume.intercept, volume.format) == (0.5, -2.0, "parrec")


@given(
    shape=st.tuples(st.integers(1, 3), *[st.integers(2, 5)] * 3),
    seed=st.integers(0, 999),
    angles=st.tuples(*[st.integers(-40, 40)] * 3),
)
def test_each_slice_has_its_scale(tmp_path_factory, shape, seed, angles):
    draws = np.random.default_rng(seed)
    scales = draws.uniform(0.1, 2, (*shape[:2], 2))
    values = draws.integers(0, 60_000, shape).astype("<u2")
    told = {"angulation": "0 0 0"} if seed % 2 else {}
    path = write(tmp_path_factory.mktemp("par"), values, scales.tolist(), centre=angles, **told)
    for index in range(shape[0]):
        volume = read(path, volume_index=index)
        assert_same_as_nibabel(volume, loaded(path), None if shape[0] == 1 else index)
        np.testing.assert_allclose(
            physical(volume),
            values[index] * scales[index, :, :1, None] + scales[index, :, 1:, None],
            rtol=1e-6,
        )
        assert volume.values.dtype == np.float32


def test_slices_lie_where_the_header_says_in_the_data_file(tmp_path):
    values = counting((2, 3, 4, 5), "<u2")
    path = write(tmp_path, values, order=[4, 2, 0, 1, 5, 3])
    for index in range(2):
        np.testing.assert_array_equal(read(path, volume_index=index).values, values[index])


@pytest.mark.parametrize("order", [[0, 0, 1], [0, 1, 3], [-1, 0, 1]])
def test_a_slice_twice_or_nowhere_is_refused(tmp_path, order):
    path = write(tmp_path, counting((1, 3, 4, 5), "<u2"))
    path.write_text(par_header((5, 4, 3), same_scales(1, 3), order=order))
    with pytest.raises(DamagedVolumeError, match="expected each slice once"):
        read(path)


@pytest.mark.parametrize("name", ["a.PAR", "a.REC"])
def test_a_pair_is_known_whichever_file_is_named(tmp_path, name):
    path = write(tmp_path, counting((1, 3, 4, 5), "<u2"))
    assert read(tmp_path / name).files == (path, tmp_path / "a.REC")


def test_a_file_without_its_other_is_refused(tmp_path):
    path = write(tmp_path, counting((1, 3, 4, 5), "<u2"))
    data = tmp_path / "a.REC"
    content = data.read_bytes()
    data.unlink()
    with pytest.raises(VolumeError, match=r"a\.PAR \(a\.REC\): cannot be opened"):
        read(path)
    data.write_bytes(content)
    path.unlink()
    with pytest.raises(VolumeError, match=r"its header a\.PAR is not there; put it beside"):
        read(data)


def test_several_volumes_are_listed_and_chosen_from(tmp_path):
    path = write(tmp_path, counting((3, 3, 4, 5), "<u2"))
    with pytest.raises(AmbiguousVolumeError, match="3 volumes found"):
        read(path)
    (entry,) = list_volumes(str(path), ReadSettings())
    assert entry.description == "parrec, 3 volumes (--volume-index 0 to 2)"
    assert entry.size == (5, 4, 3)
    assert entry.volumes[2] == "time 2 (dynamic 3, 0 s), 5 x 4 x 3"
    for time in (0, 1, 2):
        np.testing.assert_array_equal(read(path, time=str(time)).values, read(path, volume_index=time).values)
    with pytest.raises(SettingsError, match=r"time is '3'; .* has time 0 to 2"):
        read(path, time="3")


def of_volumes(numbers, slices=3):
    """Numbers of volumes for each of their slices."""
    return [number for number in numbers for _ in range(slices)]


def test_what_volumes_differ_in_is_told_in_words_and_chosen_by_time(tmp_path):
    """Two echoes of two dynamics: nibabel sorts dynamics to be slower."""
    values = counting((4, 3, 4, 5), "<u2")
    told = {"dynamics": 2, "echoes": 2, "dynamic": of_volumes((1, 1, 2, 2)), "echo": of_volumes((1, 2, 1, 2))}
    path = write(tmp_path, values, **told)
    (entry,) = list_volumes(str(path), ReadSettings())
    assert [label.split(" (")[0] for label in entry.volumes] == ["time 0", "time 0", "time 1", "time 1"]
    assert ["echo 1" in label for label in entry.volumes] == [False, True, False, True]
    np.testing.assert_array_equal(read(path, time="1", volume_index=1).values, values[3])
    (entry,) = list_volumes(str(path), ReadSettings(time="1"))
    assert entry.description == "parrec, 2 volumes (--volume-index 0 to 1)"
    with pytest.raises(AmbiguousVolumeError, match=r"2 volumes found \(echo 0 to 1"):
        read(path, time="1")


def test_phases_of_the_heart_are_times_where_there_is_one_dynamic(tmp_path):
    values = counting((3, 3, 4, 5), "<u2")
    path = write(tmp_path, values, dynamics=1, dynamic=1, phase=of_volumes((1, 2, 3)))
    np.testing.assert_array_equal(read(path, time="2").values, values[2])
    assert list_volumes(str(path), ReadSettings())[0].volumes[1].startswith("time 1 (phase 2, ")


def test_types_of_images_are_named(tmp_path):
    told = {"dynamics": 1, "dynamic": 1, "kind": of_volumes((0, 3)), "sequence": of_volumes((2, 4))}
    path = write(tmp_path, counting((2, 3, 4, 5), "<u2"), **told)
    assert list_volumes(str(path), ReadSettings())[0].volumes == (
        "image type 0 (magnitude), 5 x 4 x 3",
        "image type 1 (phase), 5 x 4 x 3",
    )
    with pytest.raises(SettingsError, match="has no such axis"):
        read(path, time="1")


def test_volumes_that_are_no_combinations_are_told_one_by_one(tmp_path):
    told = {"dynamics": 2, "dynamic": of_volumes((1, 1, 2)), "kind": of_volumes((0, 3, 0))}
    path = write(tmp_path, counting((3, 3, 4, 5), "<u2"), **told)
    (entry,) = list_volumes(str(path), ReadSettings())
    assert len({*entry.volumes}) == 3
    assert all("image type" in label and "dynamic" in label for label in entry.volumes)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"version": "V3"}, "KeyError: 'V3'"),
        ({"slices": 4}, "no PAR header that can be understood"),
        ({"slices": 10**15}, "no PAR header that can be understood"),
        ({"bits": 32}, "Only 8- and 16-bit"),
        ({"bits": [8, 16, 16]}, "Varying image pixel size"),
        ({"nx": 100_000, "ny": 100_000}, "bytes found in a.REC"),
        ({"nx": -5}, "expected positive numbers"),
        ({"slope": [1.0, 0.0, 1.0]}, "slope 0 and intercept 0 of slice 1"),
        ({"slope": ["1", "nan", "1"]}, "slope nan"),
        ({"intercept": "inf"}, "intercept inf"),
        ({"kind": [0, 3, 0]}, "image_type_mr 0 and 3 found in one volume"),
        ({"place": ["0 0 0", "0 0 0", "0 0 0"]}, "mm from where the header puts"),
        ({"dx": 0}, "span the space"),
        ({"dx": "nan"}, "no PAR header|finite"),
    ],
    ids=str,
)
def test_headers_that_cannot_be(tmp_path, changes, told):
    with pytest.raises(VolumeError, match=told) as caught:
        read(write(tmp_path, counting((1, 3, 4, 5), "<u2"), **changes))
    assert caught.value.exit_status == 3


def test_lines_that_would_take_ages_are_refused(tmp_path):
    path = write(tmp_path, counting((1, 3, 4, 5), "<u2"))
    text = path.read_text()
    path.write_text(text.replace(".    Patient name", "." + 5000 * " " + "x\n.    Patient name"))
    with pytest.raises(DamagedVolumeError, match="a line of more than"):
        read(path)
    line = text.splitlines()[-1]
    path.write_text(text.replace(line, "\n".join([line] * 40_000)))
    with pytest.raises(DamagedVolumeError, match="lines of them"):
        read(path)


def test_values_that_are_cut_short_are_refused(tmp_path):
    path = write(tmp_path, counting((1, 3, 4, 5), "<u2"))
    (tmp_path / "a.REC").write_bytes((tmp_path / "a.REC").read_bytes()[:-1])
    with pytest.raises(DamagedVolumeError, match=r"119 bytes found in a\.REC, 120 expected"):
        read(path)


def test_what_is_no_header_is_refused(tmp_path):
    path = write(tmp_path, counting((1, 3, 4, 5), "<u2"))
    path.write_bytes(bytes(range(256)) * 9)
    with pytest.raises(DamagedVolumeError, match="no PAR header that can be understood"):
        read(path)


@pytest.mark.parametrize("name", ["phantom_EPI_asc_CLEAR_2_1.PAR", "phantom_varscale.PAR"])
def test_nibabels_own_scans(name):
    path = nibabels_own(name)
    for index in range(3):
        assert_same_as_nibabel(read(path, volume_index=index), loaded(path), index)


def test_nibabels_own_truncated_scan():
    with pytest.raises(DamagedVolumeError, match="Found 3 dynamic scan values, but expected 4"):
        read(nibabels_own("phantom_truncated.PAR"))


@pytest.mark.parametrize(
    "name",
    [
        "Phantom_EPI_3mm_cor_20APtrans_15RLrot_SENSE_15_1",
        "Phantom_EPI_3mm_sag_15AP_SENSE_13_1",
        "Phantom_EPI_3mm_tra_-30AP_10RL_20FH_SENSE_14_1",
        "T2_-interleaved",
        "phantom_fake_v4",
        "phantom_fake_v4_1",
    ],
)
def test_slices_of_nibabels_own_headers_lie_where_they_tell(tmp_path, name):
    """The values are made up; where the slices lie was told by the scanner, twice."""
    content = nibabels_own(f"{name}.PAR").read_bytes()
    (tmp_path / "a.PAR").write_bytes(content)
    with (tmp_path / "a.PAR").open() as file:
        header = PARRECHeader.from_fileobj(file)
    (tmp_path / "a.REC").write_bytes(bytes(int(np.prod(header.get_rec_shape())) * 2))
    np.testing.assert_allclose(read(tmp_path / "a.PAR", volume_index=0).affine, header.get_affine())


@pytest.mark.parametrize("name", ["R11_T2W_TSE", "umass_anonymized"])
def test_slices_that_lie_elsewhere_are_refused(tmp_path, name):
    """Of the first the slices run the other way: its mesh would be mirrored."""
    (tmp_path / "a.PAR").write_bytes(nibabels_own(f"{name}.PAR").read_bytes())
    (tmp_path / "a.REC").write_bytes(bytes(10))
    with pytest.raises(UnsupportedFormatError, match="mm from where the header puts"):
        read(tmp_path / "a.PAR", volume_index=0)


@pytest.mark.parametrize("what", ["slices/locations", "dynamics", "echoes"])
def test_more_of_something_than_the_lines_have_is_refused(tmp_path, what):
    path = write(tmp_path, counting((1, 3, 4, 5), "<u2"))
    header = path.read_text()
    line = next(line for line in header.splitlines() if f"Max. number of {what}" in line)
    path.write_text(header.replace(line, f"{line[:-1]}9"))
    with pytest.raises(DamagedVolumeError, match="all slices there"):
        read(path)
