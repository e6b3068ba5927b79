"""`dmc batch` in pipelines: folders are made, lines have what a script asks for, JUnit has the verdicts."""

import json
import re
from xml.etree import ElementTree

import pytest

from dmc_cli.app import conversion
from dmc_cli.app.junit import junit_text
from dmc_cli.app.outcomes import QUALITY, Outcome

SPHERE, TORUS = "synth:sphere:16", "synth:torus:16"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def outcomes(result):
    return [json.loads(line) for line in result.stdout.splitlines()]


def cases(path):
    """The test cases of a file: name, and what failed of it."""
    suite = ElementTree.parse(path).getroot().find("testsuite")
    found = {}
    for case in suite.findall("testcase"):
        assert float(case.get("time")) >= 0
        failed = [
            (child.tag, child.get("type"), child.get("message"))
            for child in case
            if child.tag != "properties"
        ]
        found[case.get("name")] = failed
    return found


def properties(path, name):
    (case,) = (one for one in ElementTree.parse(path).iter("testcase") if one.get("name") == name)
    return {one.get("name"): one.get("value") for one in case.iter("property")}


@pytest.mark.parametrize("jobs", [1, 2])
def test_folders_of_outputs_are_made(run, folder, jobs):
    words = (
        "-o",
        "out/{stem}/a/{isovalue}.ply",
        "--report",
        "reports/{stem}/{isovalue}.json",
        "--jobs",
        jobs,
    )
    result = run("batch", SPHERE, TORUS, "-i", 0, "-i", 0.1, *words)
    assert result.exit_code == 0
    for one in outcomes(result):
        assert (folder / one["output"]).is_file()
        assert json.loads((folder / one["report"]).read_text())["mesh"]["quads"] == one["quads"]
    assert outcomes(result)[0]["report"] == "reports/synth_sphere_16/0.json"


@pytest.mark.parametrize("jobs", [1, 2])
def test_folders_of_items_that_fail_do_not_stay(run, folder, jobs):
    result = run("batch", SPHERE, "missing.nii", "-i", 0, "-o", "out/{stem}/b/mesh.ply", "--jobs", jobs)
    assert [one["status"] for one in outcomes(result)] == [0, 3]
    assert [path.name for path in (folder / "out").iterdir()] == ["synth_sphere_16"]
    result = run("batch", SPHERE, "-i", 0, "-o", "new/{stem}/mesh.ply", "--dry-run")
    assert result.exit_code == 0
    assert not (folder / "new").exists()


def test_a_folder_that_cannot_be_made_fails_its_item_alone(run, folder):
    (folder / "synth_sphere_16").write_text("no folder")
    result = run("batch", SPHERE, TORUS, "-i", 0, "-o", "{stem}/mesh.ply")
    assert [one["status"] for one in outcomes(result)] == [9, 0]
    assert "synth_sphere_16/mesh.ply" in outcomes(result)[0]["error"]


def test_folders_of_a_template_of_convert_are_made(run, folder):
    assert run("convert", SPHERE, "out/{isovalue}/mesh.ply", "-i", 0, "-i", 0.1).exit_code == 0
    assert {path.parent.name for path in folder.rglob("*.ply")} == {"0", "0.1"}
    result = run("convert", SPHERE, "other/mesh.ply", "-i", 0)
    assert result.exit_code == 9
    assert not (folder / "other").exists()


def test_a_line_has_seconds_counts_quality_verdicts_and_the_report(run, folder):
    words = ("-o", "{stem}.ply", "--report", "{stem}.json", "--require", "closed,genus<=0")
    result = run("batch", SPHERE, TORUS, "-i", 0, *words)
    assert result.exit_code == 8
    sphere, torus = outcomes(result)
    for one, met in ((sphere, True), (torus, False)):
        report = json.loads((folder / one["report"]).read_text())
        assert one["quality"] == {key: report["quality"][key] for key in QUALITY}
        assert one["requirements"] == report["requirements"]
        assert [verdict["met"] for verdict in one["requirements"]] == [True, met]
        assert one["vertices"] == report["mesh"]["vertices"]
        assert one["seconds"] > 0
        assert (folder / one["output"]).exists() == met
    assert (torus["status"], torus["quads"] > 0) == (6, True)


def test_a_line_without_a_report_has_the_quality_that_takes_no_time(run, folder):
    (plain,) = outcomes(run("batch", SPHERE, "-i", 0, "-o", "b.ply"))
    words = ("-o", "b.ply", "--force", "--report", "{stem}.json")
    (reported,) = outcomes(run("batch", SPHERE, "-i", 0, *words))
    assert (plain["requirements"], plain["report"]) == ([], None)
    assert reported["quality"]["self_intersections"] == 0
    assert plain["quality"] == {**reported["quality"], "self_intersections": None}


@pytest.mark.parametrize("jobs", [1, 3])
def test_junit_has_a_case_an_item(run, folder, jobs):
    words = ("-o", "{stem}.ply", "--require", "genus<=0,shape_min>=0.1", "--junit", "j.xml", "--jobs", jobs)
    result = run("batch", SPHERE, TORUS, "missing.nii", "-i", 0, *words)
    assert result.exit_code == 8
    found = cases("j.xml")
    assert list(found) == ["synth_sphere_16.ply", "synth_torus_16.ply", "missing.ply"]
    assert found["synth_sphere_16.ply"] == []
    ((kind, status, told),) = found["synth_torus_16.ply"]
    assert (kind, status) == ("failure", "status 6")
    assert "genus<=0: 1 was found" in told
    ((kind, status, told),) = found["missing.ply"]
    assert (kind, status) == ("error", "status 3")
    suite = ElementTree.parse("j.xml").getroot()
    assert {key: suite.get(key) for key in ("tests", "failures", "errors")} == {
        "tests": "3",
        "failures": "1",
        "errors": "1",
    }
    known = properties("j.xml", "synth_torus_16.ply")
    assert known["require genus<=0"] == "not met: 1"
    assert known["require shape_min>=0.1"].startswith("met: 0.")
    assert known["quads"] == str(outcomes(result)[1]["quads"])


def test_junit_is_the_same_but_for_times(run, folder):
    words = ("batch", SPHERE, TORUS, "-i", 0, "-o", "{stem}.ply", "--force", "--junit", "j.xml", "--jobs")
    texts = set()
    for jobs in (1, 2, 2):
        assert run(*words, jobs).exit_code == 0
        texts.add(re.sub(r'time="[\d.]+"', "", (folder / "j.xml").read_text("utf-8")))
    assert len(texts) == 1


@pytest.mark.parametrize("text", ["<&>\"'\n\t", "\x00\x1b[31m\x7f", "\ud800\ufffe", "Größe 一 𝕏", ""])
def test_whatever_names_and_messages_hold_the_document_is_well_formed(text):
    outcome = Outcome(input=text, isovalue=0.5, output=text, status=3, error=text)
    root = ElementTree.fromstring(junit_text([outcome]).encode())
    (case,) = root.iter("testcase")
    if text.isprintable():
        assert case.get("name") == case.find("error").get("message") == text


def test_no_item_gives_a_suite_without_cases():
    root = ElementTree.fromstring(junit_text([]).encode())
    assert (root.get("tests"), list(root.iter("testcase"))) == ("0", [])


@pytest.mark.parametrize("jobs", [1, 2])
def test_junit_of_a_run_that_is_stopped_has_what_is_done_and_skips_the_rest(run, folder, monkeypatch, jobs):
    whole = conversion.convert

    def until_stopped(item, *args, **kwargs):
        if "torus" in item.input:
            raise KeyboardInterrupt
        return whole(item, *args, **kwargs)

    monkeypatch.setattr(conversion, "convert", until_stopped)
    words = (SPHERE, TORUS, "-i", 0, "-o", "{stem}.ply", "--jobs", jobs, "--junit", "new/deep/j.xml")
    result = run("batch", *words)
    assert result.exit_code not in (0, 8)
    assert [line["output"] for line in outcomes(result)] == ["synth_sphere_16.ply"]
    found = cases("new/deep/j.xml")
    assert list(found) == ["synth_sphere_16.ply", "synth_torus_16.ply"]
    assert found["synth_sphere_16.ply"] == []
    ((kind, _, told),) = found["synth_torus_16.ply"]
    assert (kind, told) == ("skipped", "the run was stopped before this item was done")
    suite = ElementTree.parse("new/deep/j.xml").getroot()
    assert (suite.get("tests"), suite.get("skipped"), suite.get("errors")) == ("2", "1", "0")


def test_the_folder_of_junit_is_made(run, folder):
    assert run("batch", SPHERE, "-i", 0, "-o", "a.ply", "--junit", "new/j.xml").exit_code == 0
    assert list(cases("new/j.xml")) == ["a.ply"]


def test_junit_is_an_output_of_its_own(run, folder):
    words = ("batch", SPHERE, "-i", 0, "-o", "a.ply")
    result = run(*words, "--junit", "a.ply")
    assert result.exit_code == 2
    assert "a.ply is the mesh and a.ply the verdicts" in result.stderr
    (folder / "j.xml").write_text("mine")
    result = run(*words, "--junit", "j.xml")
    assert (result.exit_code, result.stdout, (folder / "j.xml").read_text()) == (9, "", "mine")
    assert not (folder / "a.ply").exists()
    assert run(*words, "--junit", "j.xml", "--force").exit_code == 0
    assert list(cases("j.xml")) == ["a.ply"]
    (folder / "b.toml").write_text("inputs = 'synth:sphere:8'\nisovalue = 0\njunit = 'k.xml'")
    result = run("batch", "b.toml")
    assert (result.exit_code, "give it on the command line" in result.stderr) == (2, True)
