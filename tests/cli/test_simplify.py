"""`--simplify` on the command line: what the report tells of the mesh before and after."""

import json
from pathlib import Path

import jsonschema
import pytest

from dmc_cli.app.conversion import convert
from dmc_cli.settings import ConvertSettings, MeshSettings, OutputSettings, SurfaceSettings

SCHEMA = json.loads((Path(__file__).parents[2] / "docs/report-schema.json").read_text("utf-8"))

FIELD = ("convert", "synth:genus_two:48", "-i", 0)


@pytest.fixture
def reports(run, tmp_path):
    """The reports of the same surface as it is, and simplified."""
    settings = {"none": (), "all": ("--simplify", "all"), "more": ("--remesh", 4)}
    made = {}
    for name, words in settings.items():
        path, mesh = tmp_path / f"{name}.json", tmp_path / f"{name}.ply"
        command = (FIELD[0], FIELD[1], mesh, *FIELD[2:], "--report", path, *words)
        assert run(*command).exit_code == 0
        made[name] = json.loads(path.read_text("utf-8"))
    return made


def test_the_mesh_before_simplification_is_measured_like_the_one_after(reports):
    plain = reports["none"]
    for name in ("all", "more"):
        before = reports[name]["simplification"]["before"]
        for section in ("topology", "quality", "deviation"):
            assert before[section] == plain[section]
        assert before["topology"]["irregular_percent"] == pytest.approx(
            reports[name]["simplification"]["irregular_percent_before"]
        )
        assert reports[name]["quality"] != plain["quality"]


def test_reports_on_simplification_follow_the_schema(reports):
    for report in reports.values():
        jsonschema.validate(report, SCHEMA)
    assert reports["none"]["simplification"] is None
    assert set(reports["more"]["simplification"]) == set(SCHEMA["properties"]["simplification"]["properties"])


def test_nothing_is_measured_unless_a_report_asks_for_it(tmp_path):
    mesh = MeshSettings(simplify="all")
    output = OutputSettings(path=str(tmp_path / "mesh.ply"))
    settings = ConvertSettings(
        input=FIELD[1], surface=SurfaceSettings(isovalue=0.0), mesh=mesh, output=output
    )
    report = convert(settings).report
    assert report["simplification"]["before"] is None
    assert report["simplification"]["removed_3x3y"] > 0
