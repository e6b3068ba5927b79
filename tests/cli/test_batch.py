"""`dmc batch`: all items, whatever happens to one; the same bytes on every run."""

import json
import textwrap

import pytest

from dmc_cli.cli.conversions import _stem


@pytest.fixture
def scans(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scans").mkdir()
    for field in ("torus", "sphere"):
        run("synth", field, tmp_path / "scans" / f"{field}.nii.gz", "-n", 20)
    return tmp_path


NO_FILES = ["", ".", "./", "/", "..", "a/.."]
"""Templates of outputs that have no last name."""


def outcomes(result):
    return [json.loads(line) for line in result.stdout.splitlines()]


def timeless(result):
    """The lines without how long they took."""
    assert all(outcome["seconds"] > 0 for outcome in outcomes(result))
    return [outcome | {"seconds": None} for outcome in outcomes(result)]


def meshes(folder):
    return {path.name: path.read_bytes() for path in folder.rglob("*.ply")}


def test_every_input_at_every_isovalue(run, scans):
    result = run("batch", "scans/*.nii.gz", "-i", 0, "-i", 0.1)
    assert result.exit_code == 0
    assert [(o["input"], o["isovalue"], o["status"]) for o in outcomes(result)] == [
        ("scans/sphere.nii.gz", 0, 0),
        ("scans/sphere.nii.gz", 0.1, 0),
        ("scans/torus.nii.gz", 0, 0),
        ("scans/torus.nii.gz", 0.1, 0),
    ]
    assert set(meshes(scans)) == {"sphere_0.ply", "sphere_0.1.ply", "torus_0.ply", "torus_0.1.ply"}
    assert "4 item(s) done" in result.stderr


def test_a_batch_writes_what_convert_writes(run, scans):
    run(
        "batch", "scans/torus.nii.gz", "-i", 0, "--border", "closed", "-o", "a.ply", "--report", "{stem}.json"
    )
    run("convert", "scans/torus.nii.gz", "b.ply", "-i", 0, "--border", "closed")
    assert (scans / "a.ply").read_bytes() == (scans / "b.ply").read_bytes()
    assert json.loads((scans / "torus.json").read_text())["topology"]["genus"] == 1


@pytest.mark.parametrize("jobs", [1, 3])
def test_a_failure_does_not_stop_the_others(run, scans, jobs):
    (scans / "scans" / "broken.nii.gz").write_bytes(b"no scan")
    result = run("batch", "scans/*.nii.gz", "missing.nii", "-i", 0, "--jobs", jobs)
    assert result.exit_code == 8
    assert [(o["input"], o["status"]) for o in outcomes(result)] == [
        ("scans/broken.nii.gz", 3),
        ("scans/sphere.nii.gz", 0),
        ("scans/torus.nii.gz", 0),
        ("missing.nii", 3),
    ]
    assert "broken.nii.gz" in outcomes(result)[0]["error"]
    assert "2 of 4 item(s) failed" in result.stderr
    assert set(meshes(scans)) == {"sphere_0.ply", "torus_0.ply"}


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_device_that_is_missing_fails_its_items(run, scans, jobs):
    result = run("batch", "synth:torus:12", "-i", 0, "-i", 0.1, "--device", "cuda:99", "--jobs", jobs)
    assert result.exit_code == 8
    assert [o["status"] for o in outcomes(result)] == [7, 7]


def test_jobs_share_the_budget(run, scans):
    words = ["batch", "synth:sphere:41", "synth:sphere:40", "-i", 0, "--force", "--memory", "1M"]
    assert run(*words).exit_code == 0
    assert run(*words[:2], *words[3:], "--jobs", 2).exit_code == 0  # one item has no other to share with
    result = run(*words, "--jobs", 2)
    assert [o["status"] for o in outcomes(result)] == [7, 7]
    told = "more than the 0.5 MiB that each of 2 jobs has of the 1.0 MiB of --memory"
    assert told in outcomes(result)[0]["error"]


def test_jobs_share_what_is_free(run, scans, monkeypatch):
    for module in ("dmc_cli.app.batch", "dmc_cli.app.memory_budget"):
        monkeypatch.setattr(f"{module}.available_bytes", lambda: 400_000)
    words = ["batch", "synth:torus:40", "synth:sphere:40", "-i", 0, "--force"]
    assert run(*words).exit_code == 0
    result = run(*words, "--jobs", 2)
    assert [o["status"] for o in outcomes(result)] == [7, 7]
    assert "0.4 MiB of memory are free, 0.2 MiB for each of 2 jobs; " in outcomes(result)[0]["error"]


def test_repeated_runs_and_jobs_give_the_same_bytes(run, scans):
    words = ["batch", "scans/*.nii.gz", "synth:iwp:24", "-i", 0, "-i", 0.05, "--force"]
    first = run(*words)
    found = meshes(scans)
    for extra in ([], ["--jobs", "2"], ["--jobs", "4", "--threads", "1"]):
        again = run(*words, *extra)
        assert timeless(again) == timeless(first)
        assert meshes(scans) == found


def test_a_toml_file_holds_the_options(run, scans):
    (scans / "study.toml").write_text(
        textwrap.dedent("""
            inputs = ["scans/*.nii.gz"]
            isovalue = 0
            border = "closed"
            output = "{stem}.ply"

            [[items]]

            [[items]]
            inputs = "synth:noise:12"
            isovalues = [0, 0.5]
            seed = 3
            require = ["manifold", "closed"]
            output = "noise_{isovalue}.ply"
        """)
    )
    result = run("batch", scans / "study.toml")
    assert result.exit_code == 0, result.output
    assert set(meshes(scans)) == {"sphere.ply", "torus.ply", "noise_0.ply", "noise_0.5.ply"}
    run("convert", "synth:noise:12", "one.ply", "-i", 0.5, "--seed", 3, "--border", "closed")
    assert (scans / "one.ply").read_bytes() == (scans / "noise_0.5.ply").read_bytes()


def test_common_inputs_are_converted_where_every_item_has_its_own(run, scans):
    (scans / "study.toml").write_text(
        textwrap.dedent("""
            inputs = "scans/*.nii.gz"
            isovalue = 0
            output = "{stem}.ply"

            [[items]]
            input = "synth:torus:12"
            border = "closed"
        """)
    )
    result = run("batch", scans / "study.toml")
    assert result.exit_code == 0, result.output
    assert set(meshes(scans)) == {"sphere.ply", "torus.ply", "synth_torus_12.ply"}


def test_paths_are_relative_to_the_file_and_options_go_before_it(run, scans, monkeypatch):
    (scans / "study.toml").write_text('inputs = "scans/torus.nii.gz"\nisovalue = 9\noutput = "{stem}.ply"\n')
    elsewhere = scans / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    assert run("batch", scans / "study.toml").exit_code == 8
    assert run("batch", scans / "study.toml", "-i", 0).exit_code == 0
    assert (scans / "torus.ply").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["nothing/*.nii", "-i", "0"], "no file matches nothing/*.nii"),
        (["synth:iwp:8", "-i", "half"], "'half' is no isovalue"),
        (
            ["synth:iwp:8", "-i", "0", "-o", "{stm}.ply"],
            "expected {stem}, {name}, {parent}, {isovalue}, {index}",
        ),
        (
            ["synth:iwp:8", "-i", "0", "-o", "-"],
            "output is -, but standard output is one file, or has a batch's outcomes",
        ),
        (["synth:iwp:8", "synth:torus:8", "-i", "0", "-o", "a.ply"], "use {stem} and {isovalue}"),
        (["a.npy", "./a.npy", "-i", "10", "-i", "10.0"], "a_10.ply is the output of a.npy at 10 twice"),
        *[
            (["synth:iwp:8", "-i", "0", "-o", at], f"output is {at!r}, which names no file")
            for at in NO_FILES
        ],
        (["synth:iwp:8", "-i", "0", "--report", ""], "report is '', which names no file"),
        (["synth:iwp:8", "-i", "0", "--halfedges", "."], "halfedges is '.', which names no file"),
        (["nameless.toml"], "output is '', which names no file"),
        (["missing.toml", "b", "-i", "1", "-i", "1.0000001"], "or more digits, as in {isovalue:.9f}"),
        (["-", "-i", "0", "-i", "1", "--input-format", "nrrd"], "standard input is read by several items"),
        (["missing.toml"], "missing.toml cannot be read"),
        (["bad.toml"], "bad.toml is no TOML file"),
        (["unknown.toml"], "'isovlaue' is no option of dmc batch; expected one of"),
        (["wrong.toml"], "shape is [1, 2]; "),
        (["items.toml"], "items is no list of tables"),
    ],
)
def test_a_plan_that_cannot_be_made_is_a_usage_error(run, tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.toml").write_text("inputs = [")
    (tmp_path / "unknown.toml").write_text('inputs = "synth:iwp:8"\nisovlaue = 0')
    (tmp_path / "wrong.toml").write_text('inputs = "synth:iwp:8"\nisovalue = 0\nshape = [1, 2]')
    (tmp_path / "items.toml").write_text("items = 3")
    (tmp_path / "nameless.toml").write_text('inputs = "synth:iwp:8"\nisovalue = 0\noutput = ""')
    result = run("batch", *words)
    assert result.exit_code == 2
    assert message in " ".join(result.stderr.split())
    assert result.stdout == ""


@pytest.mark.parametrize(
    ("source", "template", "expected"),
    [
        ("torus.nii.gz", "{parent}_{stem}.ply", "scans_torus.ply"),
        ("torus.nii.gz", "{parent}/{stem}.ply", "torus.ply"),
        ("./torus.nii.gz", "{parent}_{stem}.ply", "scans_torus.ply"),
        ("../scans/torus.nii.gz", "{parent}/{stem}.ply", "torus.ply"),
        ("../torus.nii.gz", "{parent}/{stem}.ply", "../torus.ply"),
        ("synth:torus:8", "{parent}_{stem}.ply", "scans_synth_torus_8.ply"),
    ],
)
@pytest.mark.parametrize("from_file", [False, True])
def test_the_parent_of_an_input(run, scans, monkeypatch, source, template, expected, from_file):
    folder = scans / "scans"
    (scans / "torus.nii.gz").write_bytes((folder / "torus.nii.gz").read_bytes())
    if from_file:
        (folder / "study.toml").write_text(f"inputs = {source!r}\nisovalue = 0\noutput = {template!r}\n")
        result = run("batch", "scans/study.toml")
    else:
        monkeypatch.chdir(folder)
        result = run("batch", source, "-i", 0, "-o", template)
    assert result.exit_code == 0, result.output
    assert [path.resolve() for path in scans.rglob("*.ply")] == [(folder / expected).resolve()]


@pytest.mark.parametrize(
    ("source", "stem"),
    [
        ("a/scan.nii.gz", "scan"),
        ("a/scan.nrrd.zst", "scan"),
        ("a/scan.tar.xz", "scan"),
        ("a/scan.v2.nrrd", "scan.v2"),
        ("synth:iwp:8", "synth_iwp_8"),
        ("a/DICOM", "DICOM"),
    ],
)
def test_the_stem_of_an_input(source, stem):
    assert _stem(source) == stem
