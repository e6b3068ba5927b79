"""`--require`: words and comparisons, of conversions and mesh files, and where the verdicts are told."""

import json

import pytest

from dmc_cli.app import convert, measure_file
from dmc_cli.errors import RequirementError
from dmc_cli.requirements import MEASURE_FIGURES, MESH_FIGURES
from dmc_cli.settings import ConvertSettings, MeasureSettings, OutputSettings, SurfaceSettings

TORUS = ("synth:torus:24", "-i", 0)


@pytest.fixture(scope="module")
def torus(tmp_path_factory):
    """The file of a closed mesh of quads: a torus."""
    path = tmp_path_factory.mktemp("torus") / "torus.ply"
    surface, output = SurfaceSettings(isovalue=0), OutputSettings(path=str(path))
    convert(ConvertSettings(input=TORUS[0], surface=surface, output=output))
    return path


def verdicts_of(report):
    return [(one["require"], one["found"], one["met"]) for one in report["requirements"]]


def test_a_mesh_that_is_as_required_is_written_with_the_verdicts(run, tmp_path):
    report = tmp_path / "torus.json"
    words = ("--require", "closed, genus=1,shape_min>=0.1", "--report", report)
    result = run("convert", TORUS[0], tmp_path / "torus.ply", *TORUS[1:], *words)
    assert result.exit_code == 0
    assert "required  closed, genus=1, shape_min>=0.1: met\n" in result.stderr
    found = json.loads(report.read_text())
    shape = found["quality"]["shape_min"]
    assert verdicts_of(found) == [("closed", 0, True), ("genus=1", 1, True), ("shape_min>=0.1", shape, True)]
    assert found["settings"]["require"] == ["closed", "genus=1", "shape_min>=0.1"]


def test_a_figure_that_is_not_as_required_leaves_the_report_alone(run, tmp_path):
    words = ("--require", "manifold,quads<=100,shape_min>=0.999", "--report", tmp_path / "torus.json")
    result = run("convert", TORUS[0], tmp_path / "torus.ply", *TORUS[1:], *words)
    assert result.exit_code == 6
    found = json.loads((tmp_path / "torus.json").read_text())
    assert [met for _, _, met in verdicts_of(found)] == [True, False, False]
    quads = found["mesh"]["quads"]
    assert f"quads<=100: {quads} was found; expected at most 100; shape_min>=0.999: 0." in result.stderr
    assert "manifold:" not in result.stderr
    assert not (tmp_path / "torus.ply").exists()


def test_a_mesh_file_is_held_against_requirements(run, torus):
    result = run("measure", torus, "--require", "closed,components<=1")
    assert result.exit_code == 0
    assert "required  closed, components<=1: met" in result.stdout
    result = run("measure", torus, "--require", "closed,boundary_edges>0")
    assert result.exit_code == 6
    assert "required  closed: met\nrequired  boundary_edges>0: not met (0 was found)\n" in result.stdout
    assert result.stderr.startswith("Error: the mesh is not what --require asks for: boundary_edges>0: 0 was")


def test_the_json_of_a_mesh_file_has_the_verdicts_whatever_they_are(run, torus):
    result = run("measure", torus, "--json", "--require", "genus<1,all-quads")
    assert result.exit_code == 6
    assert verdicts_of(json.loads(result.stdout)) == [("genus<1", 1, False), ("all-quads", 0, True)]
    assert verdicts_of(json.loads(run("measure", torus, "--json").stdout)) == []


@pytest.mark.parametrize(
    ("required", "remedy"),
    [
        ("max_mm<1", "name the volume that the mesh was made from"),
        ("to_other.max<1", "--against"),
        ("triangle_aspect_ratio_max<5", "at most"),
    ],
)
def test_what_has_no_value_is_not_met(run, torus, required, remedy):
    result = run("measure", torus, "--json", "--require", required.replace("<", "<="))
    assert result.exit_code == 6
    assert verdicts_of(json.loads(result.stdout))[0][1:] == (None, False)
    assert "the figure has no value; expected at most" in result.stderr
    assert remedy in result.stderr


def test_what_is_required_of_the_curvature_is_measured_without_further_words(run, tmp_path, torus):
    required = "total_gaussian<0.001,mean.max>0"
    assert (
        run("measure", torus, "--require", required.replace("mean.max", "curvature.mean.max")).exit_code == 0
    )
    words = ("--require", "curvature.mean.max<0")
    result = run("convert", TORUS[0], tmp_path / "a.ply", *TORUS[1:], *words)
    assert result.exit_code == 6
    assert "was found; expected less than 0" in result.stderr


def test_a_program_gets_the_report_with_the_error(torus):
    with pytest.raises(RequirementError) as caught:
        measure_file(MeasureSettings(mesh=str(torus), require=("euler_characteristic!=0",)))
    assert verdicts_of(caught.value.report) == [("euler_characteristic!=0", 0, False)]


def test_the_figures_of_a_mesh_file_are_the_numbers_of_its_report(torus):
    report = measure_file(
        MeasureSettings(
            mesh=str(torus),
            volume=TORUS[0],
            isovalue=0,
            against=str(torus),
            density=100,
            curvature=True,
            wall=0.1,
        )
    )
    for name in MEASURE_FIGURES:
        found = report
        for key in name.split("."):
            found = found[key]
        assert found is None or isinstance(found, int | float), name
    assert set(numbers_of(report)) - {"thickness.limit"} <= set(MEASURE_FIGURES)  # given, not found


def test_a_mesh_that_is_reworked_is_held_against_requirements(run, torus, tmp_path):
    words = ("mesh", torus, tmp_path / "b.ply", "--report", tmp_path / "b.json", "--force", "--require")
    assert run(*words, "closed,faces>100").exit_code == 0
    assert (tmp_path / "b.ply").exists()
    found = json.loads((tmp_path / "b.json").read_text())
    assert verdicts_of(found) == [("closed", 0, True), ("faces>100", found["mesh"]["faces"], True)]
    numbers = {name for name in numbers_of(found) if name.startswith(("mesh.", "topology.", "quality."))}
    assert numbers <= set(MESH_FIGURES)
    (tmp_path / "b.ply").unlink()
    assert run(*words, "components>=2").exit_code == 6
    assert verdicts_of(json.loads((tmp_path / "b.json").read_text())) == [("components>=2", 1, False)]
    assert not (tmp_path / "b.ply").exists()


def numbers_of(section, path=""):
    """Yield the whole names of the numbers in a report, but those of tables."""
    for key, value in section.items():
        if isinstance(value, dict) and key != "valence_histogram":
            yield from numbers_of(value, f"{path}{key}.")
        elif isinstance(value, int | float) and not isinstance(value, bool) and key != "schema":
            yield path + key


def test_a_print_is_closed_at_the_border_unless_told_otherwise(run, tmp_path):
    out, report = tmp_path / "a.ply", tmp_path / "r.json"
    words = ("convert", "synth:iwp:16", out, "-i", 0, "--report", report, "--force")
    assert run(*words, "--require", "print").exit_code in (0, 6)
    found = json.loads(report.read_text())
    assert (found["settings"]["border"], found["topology"]["boundary_edges"]) == ("closed", 0)
    run(*words, "--require", "print", "--border", "open")
    assert json.loads(report.read_text())["settings"]["border"] == "open"
    run(*words)
    assert json.loads(report.read_text())["settings"]["border"] == "open"
