"""The report: its keys, their order, plain values; the requirements; memory and versions."""

import hashlib
import json
import math
from dataclasses import asdict, fields, replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from dmc_cli.contouring import extract_surface
from dmc_cli.errors import RequirementError
from dmc_cli.field import upload_volume
from dmc_cli.measures.deviation import measure_deviation
from dmc_cli.measures.elements import measure_elements
from dmc_cli.measures.intersections import count_intersections
from dmc_cli.measures.plain_values import plain
from dmc_cli.measures.quality import measure_quality
from dmc_cli.measures.topology import measure_topology
from dmc_cli.mesh.connectivity import connect
from dmc_cli.notices import Notice
from dmc_cli.report.memory import measure_memory
from dmc_cli.report.report import Measures, RunFacts, build_report, report_text
from dmc_cli.report.requirements import CHECKS, check_requirements
from dmc_cli.report.versions import collect_versions
from dmc_cli.requirements import WORDS
from dmc_cli.runtime.device import Device
from dmc_cli.settings import ConvertSettings, OutputSettings, SurfaceSettings
from dmc_cli.volume.volume import Volume

SCHEMA = json.loads((Path(__file__).parents[2] / "docs/report-schema.json").read_text("utf-8"))


def run_facts(values, isovalue, border="closed", path="ball.raw", files=(), warnings=()):
    """Everything that a conversion of these values knows at its end."""
    device = Device("cpu", 2)
    volume = Volume(
        values=values,
        affine=np.diag([0.5, 1.0, 2.0, 1.0]),
        space="LPS",
        path=path,
        files=files,
        warnings=warnings,
    )
    surface_settings = SurfaceSettings(isovalue=isovalue, border=border)
    surface = extract_surface(upload_volume(volume, device), surface_settings)
    mesh = connect(surface.mesh)
    measures = Measures(
        topology=measure_topology(mesh),
        quality=measure_quality(mesh),
        elements=measure_elements(mesh),
        self_intersections=count_intersections(mesh),
        deviation=measure_deviation(surface.placement, volume, volume.value_range()),
    )
    return RunFacts(
        volume=volume,
        settings=ConvertSettings(input=path, surface=surface_settings, output=OutputSettings(path="out.ply")),
        resolved={"device": "cpu", "threads": 2},
        stored_isovalue=surface.placement.frame.stored_isovalue,
        counts=surface.counts,
        vertex_count=surface.mesh.vertex_count,
        quad_count=surface.mesh.face_count,
        triangle_count=0,
        measures=measures,
        timings_ms={"read": 1.23456, "total": np.float64(2.0)},
        memory=measure_memory("cpu"),
        versions=collect_versions("cpu"),
    )


def ball(n=12):
    k, j, i = np.indices((n, n, n)) - (n - 1) / 2
    return (n / 3 - np.sqrt(i**2 + j**2 + k**2)).astype(np.float32)


@pytest.fixture(scope="module")
def facts():
    return run_facts(ball(), 0.1)


@pytest.fixture(scope="module")
def report(facts):
    return build_report(facts)


def check(report):
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    jsonschema.validate(json.loads(report_text(report)), SCHEMA)


def test_the_report_of_a_ball_keeps_the_schema(report):
    check(report)
    assert report["topology"]["genus"] == 0
    assert 0.9 < report["mesh"]["volume"] / (4 / 3 * math.pi * 3.9**3) < 1.0
    assert report["quality"]["shape_mean"] > 0.5
    assert report["deviation"]["max_relative"] < 1e-6
    assert report["surface"]["isovalue"] == 0.1
    assert report["surface"]["stored_isovalue"] == np.float32(0.1)


def test_the_keys_come_in_the_order_of_the_schema(report):
    assert list(report) == list(SCHEMA["properties"])
    for name, section in SCHEMA["properties"].items():
        if "properties" in section and report[name] is not None:
            assert list(report[name]) == list(section["properties"]), name


def test_the_report_reads_back_as_it_is(report):
    assert json.loads(report_text(report)) == report
    assert report_text(report).endswith("}\n")


def test_the_input_is_told_in_the_order_x_y_z(report):
    section = report["input"]
    assert section["shape"] == [12, 12, 12]
    assert section["spacing_mm"] == [0.5, 1.0, 2.0]
    assert section["affine"][0] == [0.5, 0.0, 0.0, 0.0]
    assert (section["dtype"], section["space"], section["sha256"]) == ("float32", "LPS", None)


def test_every_setting_is_told_resolved(report, facts):
    settings = report["settings"]
    parts = (facts.settings.surface, facts.settings.part, facts.settings.mesh, facts.settings.read)
    expected = {f.name for part in parts for f in fields(part)}
    expected |= {f.name for f in fields(facts.settings.output)} - {"path"}
    assert set(settings) == expected | {"input", "output", "device"}
    assert (settings["output"], settings["device"], settings["threads"]) == ("out.ply", "cpu", 2)


def test_without_measures_their_sections_are_null(facts):
    report = build_report(replace(facts, measures=None))
    check(report)
    assert (report["topology"], report["quality"], report["deviation"]) == (None, None, None)
    counts = {"vertices": facts.vertex_count, "quads": facts.quad_count, "triangles": 0}
    assert report["mesh"] == counts | {"area": None, "volume": None, "bounds": None, "unit": "mm"}


def test_an_open_mesh_has_no_volume():
    report = build_report(run_facts(ball()[:6], 0.0, border="open"))
    check(report)
    assert report["mesh"]["volume"] is None
    assert report["mesh"]["area"] > 0


def test_an_empty_surface_is_reported():
    report = build_report(run_facts(ball(), 100.0, border="open"))
    check(report)
    assert report["mesh"]["vertices"] == 0
    assert report["mesh"]["bounds"] is None
    assert report["deviation"]["max"] is None


def test_the_checksum_is_that_of_the_single_file(tmp_path, facts):
    file = tmp_path / "scan.raw"
    file.write_bytes(b"scan" * 1000)
    one = replace(facts, volume=replace(facts.volume, files=(file,)))
    two = replace(facts, volume=replace(facts.volume, files=(file, file)))
    assert build_report(one)["input"]["sha256"] == hashlib.sha256(b"scan" * 1000).hexdigest()
    assert build_report(two)["input"]["sha256"] is None


def test_no_data_and_the_volumes_warnings_are_told():
    values = ball()
    values[0, 0, :3] = np.nan
    report = build_report(
        run_facts(values, 0.0, border="open", warnings=(Notice("W-ORIENTATION-MISSING", "no orientation"),))
    )
    check(report)
    assert report["input"]["no_data_nodes"] == 3
    assert report["warnings"][0] == "no orientation"
    assert report["warning_codes"] == ["W-ORIENTATION-MISSING", "W-NO-DATA"]
    assert report["warnings"][1].startswith("3 nodes hold no data")


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (float("nan"), None),
        (np.float32("inf"), None),
        (np.float64(0.5), 0.5),
        (np.int64(7), 7),
        (np.bool_(True), True),
        ((1, np.uint8(2)), [1, 2]),
        ({3: np.arange(2)}, {"3": [0, 1]}),
        (np.array([1.0, np.nan]), [1.0, None]),
        (Path("a") / "b", "a/b"),
    ],
)
def test_values_become_plain(value, expected):
    found = plain(value)
    assert found == expected
    assert type(found) is type(expected)


def test_what_has_no_plain_form_is_refused():
    with pytest.raises(TypeError, match="object has no plain form"):
        plain(object())


def test_there_is_a_check_for_every_requirement():
    assert set(CHECKS) == set(WORDS)


def test_a_closed_ball_meets_every_requirement(report):
    check_requirements(report, tuple(CHECKS))


def changed(report, section, **values):
    return report | {section: report[section] | values}


@pytest.mark.parametrize(
    ("name", "section", "values", "found"),
    [
        ("manifold", "topology", {"non_manifold_edges": 4}, "4 edges with more than two faces were found"),
        ("manifold", "topology", {"non_manifold_vertices": 2}, "2 vertices whose faces form several fans"),
        ("manifold", "topology", {"misoriented_edges": 1}, "1 edges that both faces run the same way"),
        ("closed", "topology", {"boundary_edges": 9, "boundary_loops": 2}, "9 boundary edges in 2 loop"),
        ("all-quads", "mesh", {"triangles": 5}, "5 triangles were found; expected none"),
        ("no-self-intersections", "quality", {"self_intersections": 3}, "3 pairs of faces that intersect"),
        ("no-self-intersections", "quality", {"self_intersections": None}, "were not counted"),
        (
            "on-surface",
            "deviation",
            {"max_relative": 2e-5},
            "2e-05 of the value range; expected at most 1e-05",
        ),
    ],
)
def test_a_requirement_that_is_not_met_names_what_was_found(report, name, section, values, found):
    bad = changed(report, section, **values)
    with pytest.raises(RequirementError, match=f"{name}: .*{found}"):
        check_requirements(bad, [name])
    check_requirements(bad, [other for other in CHECKS if other != name])


def test_all_failures_are_named_at_once(report):
    bad = changed(changed(report, "topology", boundary_edges=1), "mesh", triangles=1)
    with pytest.raises(RequirementError, match=r"closed: .*; all-quads: ") as caught:
        check_requirements(bad, ["closed", "all-quads", "closed"])
    assert str(caught.value).count("closed: ") == 1


def test_an_unknown_deviation_does_not_pass(report):
    with pytest.raises(RequirementError, match="on-surface: the deviation is not known"):
        check_requirements(report | {"deviation": None}, ["on-surface"])


def test_memory_is_that_of_a_process_with_warp(report):
    assert 10**7 < report["memory"]["peak_rss_bytes"] < 10**11
    assert report["memory"]["device_bytes"] is None


def test_versions_are_told(report):
    assert report["versions"]["numpy"] == np.__version__
    assert report["versions"]["device"].startswith("cpu (")


def test_the_sections_hold_every_measure(report, facts):
    assert set(report["topology"]) == set(asdict(facts.measures.topology))
    assert set(report["deviation"]) == set(asdict(facts.measures.deviation))
    assert set(report["quality"]) >= set(asdict(facts.measures.elements)) | {"self_intersections"}
