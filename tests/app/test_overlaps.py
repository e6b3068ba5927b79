"""No output is an input or another output, by whatever path or link; nothing is touched then."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from dmc_cli.app import file_keys
from dmc_cli.app.overlaps import refuse_overlaps
from dmc_cli.errors import SettingsError
from dmc_cli.settings import ConvertSettings, OutputSettings, SurfaceSettings

VALUES = np.arange(27, dtype=np.uint8).reshape(3, 3, 3)
NRRD = b"NRRD0005\ntype: uchar\ndimension: 3\nsizes: 3 3 3\nencoding: raw\n"
META = b"NDims = 3\nDimSize = 3 3 3\nElementType = MET_UCHAR\nElementDataFile = "
AS_MESH = ["-i", 13.5, "--output-format", "ply", "--force"]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with one volume, a.nrrd, in it, which is the current one."""
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a.nrrd").write_bytes(NRRD + b"\n" + VALUES.tobytes())
    monkeypatch.chdir(tmp_path / "in")
    return tmp_path / "in"


def snapshot(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def refused(run, folder, *words, status=2):
    """Run `dmc`; it has to refuse, and to leave every file as it is."""
    before = snapshot(folder.parent)
    result = run(*words)
    assert result.exit_code == status, result.output
    assert snapshot(folder.parent) == before
    return " ".join((result.stderr + result.stdout).split())


@pytest.mark.parametrize(
    "path", ["a.nrrd", "./a.nrrd", "../in/a.nrrd", "{folder}/a.nrrd", "soft", "hard", "up/a.nrrd"]
)
@pytest.mark.parametrize("option", ["output", "report", "halfedges"])
def test_no_output_is_the_input(run, folder, path, option):
    os.symlink("a.nrrd", "soft")
    os.link("a.nrrd", "hard")
    os.symlink("../in", "up")
    path = path.format(folder=folder)
    if option == "halfedges":
        shutil.copy("a.nrrd", "a.npz")
        os.remove("a.nrrd")
        os.symlink("a.npz", "a.nrrd")
        path = "a.npz"
    output = path if option == "output" else "mesh.ply"
    extra = [] if option == "output" else [f"--{option}", path]
    told = refused(run, folder, "convert", "a.nrrd", output, *AS_MESH, *extra)
    role = "mesh" if option == "output" else option
    assert (
        f"{path}, the {role} to be written, is the file a.nrrd, which is read; expected a file of its own"
        in told
    )


@pytest.mark.parametrize("force", [[], ["--force"]])
def test_links_to_the_input_are_the_input(run, folder, force):
    os.symlink("a.nrrd", "b.nrrd")
    told = refused(run, folder, "convert", "b.nrrd", "a.nrrd", "-i", 13.5, "--output-format", "ply", *force)
    assert "the mesh to be written, is the file b.nrrd" in told


@pytest.mark.parametrize(
    ("mesh", "extra", "roles"),
    [
        ("m.ply", ["--report", "m.ply"], ("report", "mesh")),
        ("m.ply", ["--report", "./m.ply"], ("report", "mesh")),
        ("m.npz", ["--halfedges", "m.npz"], ("halfedges", "mesh")),
        ("m.ply", ["--halfedges", "h.npz", "--report", "h.npz"], ("report", "halfedges")),
        ("m.ply", ["--report", ".m.ply.dmc-part"], ("report", "mesh")),
        (".r.dmc-part", ["--report", "r"], ("report", "mesh")),
        ("soft.ply", ["--report", "m.ply"], ("report", "mesh")),
        ("dangling.ply", ["--report", "new.ply"], ("report", "mesh")),
    ],
)
def test_no_output_is_another_output(run, folder, mesh, extra, roles):
    (folder / "m.ply").write_bytes(b"old")
    os.symlink("m.ply", "soft.ply")
    os.symlink("new.ply", "dangling.ply")
    told = refused(run, folder, "convert", "a.nrrd", mesh, *AS_MESH, *extra)
    assert f" is the {roles[0]} and " in told
    assert f" the {roles[1]} of a.nrrd, which is one file" in told


def test_the_file_that_an_output_grows_in_is_no_input(run, folder):
    os.rename("a.nrrd", ".m.ply.dmc-part")
    refused(run, folder, "convert", ".m.ply.dmc-part", "m.ply", *AS_MESH)


def test_devices_may_be_used_by_all(run, folder):
    result = run("convert", "a.nrrd", "/dev/null", *AS_MESH, "--report", "/dev/null")
    assert result.exit_code == 0, result.output


def test_outputs_may_be_pipes_without_a_name(run, folder):
    reading, writing = os.pipe()
    with os.fdopen(reading, "rb") as reader, os.fdopen(writing, "wb"):
        result = run("convert", "a.nrrd", "m.ply", *AS_MESH, "--report", f"/dev/fd/{writing}")
        assert result.exit_code == 0, result.output
        assert reader.read1(1) == b"{"


@pytest.mark.parametrize("path", [".", "./", "/", ".."])
def test_a_folder_is_no_output(run, folder, path):
    assert "is a folder" in refused(run, folder, "convert", "a.nrrd", path, *AS_MESH, status=9)
    assert "has no suffix" in refused(run, folder, "convert", "a.nrrd", path, "-i", 13.5)
    words = ["convert", "a.nrrd", "m.ply", *AS_MESH]
    assert "is a folder" in refused(run, folder, *words, "--report", path, status=9)
    assert "has no suffix" in refused(run, folder, *words, "--halfedges", path)


def test_an_output_has_a_name(run, folder):
    words = ["convert", "a.nrrd", "m.ply", *AS_MESH]
    assert "the name of the mesh is empty" in refused(run, folder, "convert", "a.nrrd", "", *AS_MESH)
    for option in ("report", "halfedges"):
        assert f"the name of the {option} is empty" in refused(run, folder, *words, f"--{option}", "")
    assert "name is empty" in refused(run, folder, "synth", "torus", "")


def test_where_case_does_not_count_two_names_are_one(run, folder, monkeypatch):
    words = ["convert", "a.nrrd", "M.ply", *AS_MESH, "--report", "m.PLY"]
    assert run(*words).exit_code == 0
    os.remove("M.ply")
    os.remove("m.PLY")
    monkeypatch.setattr(file_keys, "folds_case", lambda folder: True)
    assert "which is one file" in refused(run, folder, *words)


def test_whether_case_counts_is_asked_of_the_disk(folder, monkeypatch):
    assert not file_keys.folds_case(str(folder))
    os.link("a.nrrd", "A.NRRD")
    assert file_keys.folds_case(str(folder))
    os.mkdir("1")
    for folds in (False, True):
        monkeypatch.setattr(file_keys, "_FOLDS_CASE", folds)
        assert file_keys.folds_case("1") == folds


HEADERS = {
    "b.nhdr": NRRD + b"data file: b.ply\n\n",
    "list.nhdr": NRRD + b"data file: LIST 2\n0.raw\nb.ply\n1.raw\n",
    "b.mhd": META + b"b.ply\n",
    "list.mhd": META + b"LIST\n0.raw\nb.ply\n1.raw\n",
}


@pytest.mark.parametrize("header", HEADERS)
@pytest.mark.parametrize("command", ["convert", "batch", "batch before"])
def test_no_output_is_detached_data(run, folder, header, command):
    is_list = header.startswith("list")
    Path(header).write_bytes(HEADERS[header])
    Path("0.raw").write_bytes(VALUES[0].tobytes())
    Path("b.ply").write_bytes((VALUES[1] if is_list else VALUES).tobytes())
    Path("1.raw").write_bytes(VALUES[2].tobytes())
    words = {
        "convert": ["convert", header, "b.ply", "-i", 13.5, "--force"],
        "batch": ["batch", header, "-i", 13.5, "--force", "-o", "b.ply"],
        # what the second item reads would be replaced by the first one
        "batch before": ["batch", "b.toml"],
    }
    Path("b.toml").write_text(
        'isovalue = 13.5\nforce = true\n[[items]]\ninputs = "a.nrrd"\noutput = "b.ply"\n'
        f'[[items]]\ninputs = "{header}"\noutput = "c.ply"\n'
    )
    told = refused(run, folder, *words[command])
    assert "b.ply, the mesh to be written, is the file b.ply, which is read" in told
    Path("b.ply").rename("d.ply")  # where the data are elsewhere the name is free
    Path(header).write_bytes(HEADERS[header].replace(b"b.ply", b"d.ply"))
    assert run(*words[command]).exit_code == 0


def test_a_header_of_any_name_has_its_data(run, folder):
    Path("b.raw").write_bytes(HEADERS["b.nhdr"])
    Path("b.ply").write_bytes(VALUES.tobytes())
    words = ["b.raw", "-i", 13.5, "--force", "--input-format", "nrrd", "-o"]
    assert "is the file b.ply, which is read" in refused(run, folder, "batch", "a.nrrd", *words, "{stem}.ply")
    assert run("batch", *words, "c.ply").exit_code == 0


@pytest.mark.parametrize(("given", "other"), [("s.hdr", "s.img"), ("s.img", "s.hdr")])
def test_no_output_is_the_other_one_of_a_pair(run, folder, given, other):
    import nibabel

    nibabel.save(nibabel.Nifti1Pair(VALUES, np.eye(4)), "s.hdr")
    told = refused(run, folder, "convert", given, other, *AS_MESH)
    assert f"is the file {other}, which is read" in told


def test_no_output_is_a_slice_of_any_series_but_a_mesh_may_lie_beside_them(run, folder, sample_data):
    for path in sorted((sample_data / "dicom" / "head_ct").iterdir())[:3]:
        shutil.copy(path, folder / path.name)
    os.remove("a.nrrd")
    first = min(os.listdir())
    told = refused(run, folder, "convert", ".", first, *AS_MESH)
    assert f"{first}, the mesh to be written, is the file" in told
    os.link(first, "../mesh.ply")
    refused(run, folder, "convert", ".", "../mesh.ply", *AS_MESH)
    refused(run, folder, "convert", first, "skull.ply", *AS_MESH, "--report", first)
    for _ in range(2):  # the second time a mesh, a dump and a report lie among the slices
        words = ["skull.ply", "-i", 300, "--force", "--report", "skull.json", "--halfedges", "skull.npz"]
        assert run("convert", ".", *words).exit_code == 0


@pytest.mark.parametrize("name", ["ct.dcm", "CT.ZIP", "stack.tif", "scan.raw"])
def test_a_folder_called_like_a_file_is_a_folder(run, folder, sample_data, name):
    """A slice that is of no series is read as well."""
    import pydicom

    os.mkdir(name)
    for number, path in enumerate(sorted((sample_data / "dicom" / "head_ct").iterdir())[:3]):
        dataset = pydicom.dcmread(path)
        dataset.SeriesInstanceUID = f"1.2.{number // 2}"
        dataset.save_as(f"{name}/{number}")
    told = refused(run, folder, "convert", name, f"{name}/2", *AS_MESH)
    assert f"the mesh to be written, is the file {name}/2, which is read" in told
    refused(run, folder, "batch", "a.nrrd", name, *AS_MESH, "-o", f"{name}/0")


def test_no_output_is_a_slice_of_a_stack_of_tiff_files_or_in_a_zip(run, folder, sample_data):
    tifffile = pytest.importorskip("tifffile")
    os.mkdir("stack")
    for k in range(3):
        tifffile.imwrite(f"stack/{k}.tif", VALUES[k])
    refused(run, folder, "convert", "stack", "stack/1.tif", *AS_MESH)
    shutil.make_archive("ct", "zip", sample_data / "dicom" / "head_ct")
    refused(run, folder, "convert", "ct.zip", "ct.zip", *AS_MESH)


@pytest.mark.parametrize("path", ["s.zarr/0.0.0", "s.zarr/new.ply", "link.ply", "hard.ply", "up/new.ply"])
def test_no_output_is_in_a_zarr_store(run, folder, path):
    zarr = pytest.importorskip("zarr", minversion="3")
    array = zarr.create_array("s.zarr", shape=(3, 3, 3), chunks=(3, 3, 3), dtype="u1", zarr_format=2)
    array[:] = VALUES
    os.symlink("s.zarr/0.0.0", "link.ply")
    os.link("s.zarr/0.0.0", "hard.ply")
    os.symlink("s.zarr", "up")
    refused(run, folder, "convert", "s.zarr", path, *AS_MESH)
    refused(
        run, folder, "batch", "a.nrrd", "s.zarr", "-i", 13.5, "--force", "-o", path, "--output-format", "ply"
    )
    assert run("convert", "s.zarr", "beside.ply", *AS_MESH).exit_code == 0


def test_a_batch_writes_over_no_input_of_any_item(run, folder):
    shutil.copy("a.nrrd", "b.nrrd")
    words = ["--output-format", "ply", "-i", 13.5, "--force"]
    told = refused(run, folder, "batch", "a.nrrd", *words, "-o", "{parent}/{name}")
    assert "a.nrrd, the mesh to be written, is the file a.nrrd, which is read" in told
    text = 'isovalue = 13.5\nforce = true\noutput-format = "ply"\n'
    items = (("a.nrrd", "c.ply"), ("b.nrrd", "a.nrrd"))
    text += "".join(f'[[items]]\ninputs = "{source}"\noutput = "{path}"\n' for source, path in items)
    Path("study.toml").write_text(text)
    assert "a.nrrd, the mesh to be written, is the file" in refused(run, folder, "batch", "study.toml")
    told = refused(run, folder, "batch", "study.toml", "-o", "{stem}.ply", "--report", "{stem}/../study.toml")
    assert "study.toml" in told
    told = refused(run, folder, "batch", "study.toml", "-o", "{stem}.ply", "--report", "./study.toml")
    assert "study.toml is the output of" in told


def test_a_batch_writes_over_no_plan_and_no_input_that_is_still_to_be_made(run, folder):
    Path("study.toml").write_text(
        'isovalue = 13.5\nforce = true\ninputs = "a.nrrd"\noutput = "a.ply"\nreport = "study.toml"'
    )
    told = refused(run, folder, "batch", "study.toml")
    assert "study.toml, the report to be written, is the file" in told
    refused(run, folder, "batch", "a.nrrd", "a_13.5.ply", "-i", 13.5)


def test_standard_streams_that_are_files_count(run_process, folder):
    before = snapshot(folder)
    with open("a.nrrd", "rb") as source, open("a.nrrd", "ab") as target:
        words = ["convert", "-", "a.nrrd", "--input-format", "nrrd", *AS_MESH]
        assert run_process(*words, stdin=source).returncode == 2
        assert snapshot(folder) == before
        words = [sys.executable, "-m", "dmc_cli", "convert", "a.nrrd", "-", *map(str, AS_MESH)]
        result = subprocess.run(words, stdout=target, check=False)
        assert result.returncode == 2
    assert snapshot(folder) == before


def test_standard_output_is_no_further_file_of_an_input(run_stdout, folder, sample_data):
    import nibabel

    os.mkdir("slices")
    for path in sorted((sample_data / "dicom" / "head_ct").iterdir())[:3]:
        shutil.copy(path, folder / "slices" / path.name)
    nibabel.save(nibabel.Nifti1Pair(VALUES, np.eye(4)), "s.hdr")
    Path("list.mhd").write_bytes(HEADERS["list.mhd"])
    for k, name in enumerate(("0.raw", "b.ply", "1.raw")):
        Path(name).write_bytes(VALUES[k].tobytes())
    for header, data in (
        ("slices", min(Path("slices").iterdir())),
        ("s.hdr", "s.img"),
        ("list.mhd", "b.ply"),
    ):
        for words in (
            ["convert", header, "-", *AS_MESH],
            ["convert", header, "mesh.ply", *AS_MESH, "--report", "-"],
            ["batch", header, *AS_MESH],
        ):
            assert "which is read" in run_stdout(data, *words)
    Path("list.toml").write_bytes(b"isovalue = 13.5\ninputs = 'list.mhd'\n")
    assert "list.toml, which is read" in run_stdout("list.toml", "batch", "list.toml")
    Path("list.ply").write_bytes(b"old")
    told = run_stdout("list.ply", "batch", "list.mhd", *AS_MESH, "-o", "list.ply")
    assert "list.ply is the mesh and - the outcomes of list.mhd, which is one file" in told


@pytest.fixture
def run_stdout(run, folder, monkeypatch):
    """Call `dmc` with a file as its standard output; it has to refuse, and to leave every file as it is."""

    def call(path, *words):
        with open(path, "ab") as target:
            monkeypatch.setattr(file_keys, "_stream", lambda stream: stream_of(target))
            return refused(run, folder, *words)

    stream_of = file_keys._stream
    return call


def test_an_empty_standard_output_is_looked_up_in_no_input(monkeypatch, tmp_path):
    for content, looks in ((b"", False), (b"x", True)):
        (tmp_path / "out").write_bytes(content)
        with (tmp_path / "out").open("a") as stream, monkeypatch.context() as patch:
            patch.setattr(sys, "stdout", stream)
            files = file_keys.FileKeys()
            assert len(files.of_output("-")) == 1
            assert files.has_outputs == looks


def item(number, path="out/{}.ply"):
    return ConvertSettings(
        input=f"in/{number}.nrrd",
        surface=SurfaceSettings(isovalue=0.0),
        output=OutputSettings(path=path.format(number), report=f"out/{number}.json"),
    )


def test_ten_thousand_items_are_looked_at_once(monkeypatch):
    looks = []
    monkeypatch.setattr(file_keys, "_status", looks.append)
    items = [item(number) for number in range(10_000)]
    refuse_overlaps(items)
    assert len(looks) < 10 * len(items)
    with pytest.raises(SettingsError, match=r"7\.ply is the output of in/7\.nrrd at 0 and of in/9999\.nrrd"):
        refuse_overlaps([*items[:-1], item(9999, "out/7.ply")])


def test_a_conversion_in_python_is_refused_as_well(folder):
    import dmc_cli as dmc

    settings = dmc.ConvertSettings(
        input="a.nrrd",
        surface=dmc.SurfaceSettings(isovalue=13.5),
        output=dmc.OutputSettings(path="a.nrrd", output_format="ply", force=True),
    )
    before = snapshot(folder)
    with pytest.raises(SettingsError, match="which is read"):
        dmc.convert(settings)
    assert snapshot(folder) == before
