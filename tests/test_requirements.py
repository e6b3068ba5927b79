"""What may be required: words, and figures of the report beside numbers."""

import json
from pathlib import Path

import pytest

from dmc_cli.errors import SettingsError
from dmc_cli.requirements import (
    CONVERT_FIGURES,
    MEASURE_FIGURES,
    MESH_FIGURES,
    NAMES,
    SETS,
    WORDS,
    Comparison,
    looks_at,
    parse_requirement,
    settled_requirements,
)
from dmc_cli.settings import MeasureSettings, OutputSettings, ReworkSettings

SCHEMA = json.loads((Path(__file__).parents[1] / "docs/report-schema.json").read_text("utf-8"))
NO_FIGURES = ("settings.", "memory.", "thickness.limit")
"""What is known only at the end, or was given."""


def numbers_of(node, path):
    """Yield the whole names of the numbers that a part of the schema has."""
    node = SCHEMA["$defs"][node["$ref"].rpartition("/")[2]] if "$ref" in node else node
    for key, part in node.get("properties", {}).items():
        yield from numbers_of(part, [*path, key])
    kinds = node.get("type", [])
    if {"number", "integer"} & set([kinds] if isinstance(kinds, str) else kinds):
        yield ".".join(path)


def test_the_figures_of_a_conversion_are_the_numbers_of_the_schema():
    found = {name for name in numbers_of(SCHEMA, []) if not name.startswith(NO_FIGURES)}
    assert set(CONVERT_FIGURES) == found


def test_every_word_looks_at_figures_of_both_reports():
    for looked_at in WORDS.values():
        assert set(looked_at) <= set(CONVERT_FIGURES) & set(MEASURE_FIGURES)


@pytest.mark.parametrize("figures", [CONVERT_FIGURES, MEASURE_FIGURES, MESH_FIGURES])
def test_every_part_of_a_set_is_a_requirement_of_every_report(figures):
    for parts in SETS.values():
        assert all(parse_requirement(part, figures) for part in parts)
        assert not set(parts) & set(SETS)
    assert all(parse_requirement(name, figures) == name for name in NAMES)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("closed", "closed"),
        ("shape_min>=0.3", Comparison("quality.shape_min", ">=", 0.3)),
        ("quality.shape_min >= .3", Comparison("quality.shape_min", ">=", 0.3)),
        ("components<=1", Comparison("topology.components", "<=", 1)),
        ("quads<2e5", Comparison("mesh.quads", "<", 200000)),
        ("genus=0", Comparison("topology.genus", "=", 0)),
        ("genus==-1", Comparison("topology.genus", "==", -1)),
        ("genus!=1", Comparison("topology.genus", "!=", 1)),
        ("vertices>0", Comparison("mesh.vertices", ">", 0)),
        ("unused_vertices>0", Comparison("topology.unused_vertices", ">", 0)),
        ("dropped.components>0", Comparison("part.dropped.components", ">", 0)),
        ("deviation.mean>0", Comparison("deviation.mean", ">", 0)),
        ("gaussian.max<1", Comparison("curvature.gaussian.max", "<", 1)),
    ],
)
def test_a_requirement_is_a_word_or_a_comparison(text, expected):
    assert parse_requirement(text, CONVERT_FIGURES) == expected


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("pretty", "require is 'pretty'; expected one of manifold, closed"),
        ("", "require is ''; expected one of"),
        ("shap_min>=0.3", "names 'shap_min', as no figure of the report is called; .* such as shape_min"),
        (
            "max<1",
            r"'max', as .* figures of the report are called; expected one of deviation\.max, curvature\.mean",
        ),
        ("nodes<1", r"expected one of part\.dropped\.nodes, part\.filled\.nodes"),
        ("total<1", "no figure of the report is called"),
        ("peak_rss_bytes<1", "no figure"),
        ("quality.quads<1", r"'quality\.quads', as no figure .*; expected one such as .*quads"),
        ("shape_min>=", "require is 'shape_min>=', where '' is no number"),
        ("shape_min>=nan", "'nan' is no number"),
        ("shape_min>=inf", "'inf' is no number"),
        ("shape_min>=0.3>0", "expected one of manifold"),
        (">=0.3", "names '', as no figure"),
        ("hape_min>=0.3", "'hape_min', as no figure .* such as shape_min"),
    ],
)
def test_what_is_neither_is_refused(text, told):
    with pytest.raises(SettingsError, match=told):
        parse_requirement(text, CONVERT_FIGURES)


@pytest.mark.parametrize(
    ("relation", "met"),
    [(">=", (0, 1, 1)), ("<=", (1, 1, 0)), (">", (0, 0, 1)), ("<", (1, 0, 0)), ("==", (0, 1, 0))],
)
def test_a_comparison_holds_below_at_and_above_its_limit(relation, met):
    asked = Comparison("quality.shape_min", relation, 0.5)
    assert tuple(asked.holds(found) for found in (0.25, 0.5, 0.75)) == tuple(map(bool, met))
    assert not asked.holds(None)


def test_walls_that_are_required_are_measured():
    assert MeasureSettings(mesh="a.ply", require=("thickness.min>=0.8",)).measures_thickness
    assert not MeasureSettings(mesh="a.ply", require=("closed",)).measures_thickness


def test_figures_of_one_report_are_none_of_the_other():
    parse_requirement("crossed_edges>0", CONVERT_FIGURES)
    parse_requirement("to_other.max<1", MEASURE_FIGURES)
    with pytest.raises(SettingsError):
        MeasureSettings(mesh="a.ply", require=("crossed_edges>0",))
    with pytest.raises(SettingsError):
        OutputSettings(path="a.ply", require=("to_other.max<1",))
    with pytest.raises(SettingsError):
        ReworkSettings(mesh="a.ply", path="b.ply", require=("total_gaussian<1",))


def test_requirements_are_settled_each_once():
    asked = (" closed", "shape_min >= 0.3 ", "closed")
    assert settled_requirements(asked, CONVERT_FIGURES) == ("closed", "shape_min >= 0.3")
    assert OutputSettings(path="a.ply", require=asked).require == ("closed", "shape_min >= 0.3")


@pytest.mark.parametrize(
    ("required", "intersections", "curvature"),
    [
        ("closed", False, False),
        ("no-self-intersections", True, False),
        ("self_intersections<5", True, False),
        ("print", True, False),
        ("fe", False, False),
        ("total_gaussian>0", False, True),
        ("gaussian.max<9", False, True),
    ],
)
def test_what_is_required_is_measured(required, intersections, curvature):
    output = OutputSettings(path="a.ply", require=(required,))
    assert (output.finds_intersections, output.finds_curvature) == (intersections, curvature)
    assert MeasureSettings(mesh="a.ply", require=(required,)).finds_curvature is curvature
    assert looks_at("quality.self", (required,), CONVERT_FIGURES) is intersections
