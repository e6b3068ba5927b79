"""Each requirement at its very limit: what is just good enough passes, what is a little more does not."""

import pytest

from dmc_cli.errors import RequirementError
from dmc_cli.mesh.near_frame import COARSE
from dmc_cli.report.requirements import ON_SURFACE, check_requirements

SOUND = {
    "topology": {
        "non_manifold_vertices": 0,
        "non_manifold_edges": 0,
        "misoriented_edges": 0,
        "boundary_edges": 0,
        "boundary_loops": 0,
    },
    "mesh": {"vertices": 8, "quads": 6},
    "deviation": {"max": 0.5, "max_relative": ON_SURFACE, "rounding_mm": 0.1, "rounding_relative": COARSE},
}
ALL = ("manifold", "closed", "all-quads", "on-surface")


def report(section, **changed):
    return SOUND | {section: SOUND[section] | changed}


def test_a_mesh_at_the_limits_is_good_enough():
    assert (ON_SURFACE, COARSE) == (1e-5, 1e-3)
    check_requirements(SOUND, ALL)


@pytest.mark.parametrize(
    ("section", "changed"),
    [
        ("mesh", {"triangles": 0}),
        ("deviation", {"rounding_relative": None}),
        ("deviation", {"max_relative": None}),
        ("deviation", {"max_relative": 0.0}),
        ("topology", {"boundary_loops": 3}),  # only edges count
    ],
)
def test_what_is_not_known_or_not_asked_is_no_fault(section, changed):
    check_requirements(report(section, **changed), ALL)


@pytest.mark.parametrize(
    ("name", "section", "changed"),
    [
        ("manifold", "topology", {"non_manifold_vertices": 1}),
        ("manifold", "topology", {"non_manifold_edges": 1}),
        ("manifold", "topology", {"misoriented_edges": 1}),
        ("closed", "topology", {"boundary_edges": 1}),
        ("all-quads", "mesh", {"triangles": 1}),
        ("on-surface", "deviation", {"max_relative": ON_SURFACE * 1.001}),
        ("on-surface", "deviation", {"rounding_relative": COARSE * 1.001}),
        ("on-surface", "deviation", {"max": None}),
    ],
)
def test_one_more_is_too_much_for_its_requirement_alone(name, section, changed):
    with pytest.raises(RequirementError, match=f"asks for: {name}: "):
        check_requirements(report(section, **changed), ALL)
    check_requirements(report(section, **changed), [other for other in ALL if other != name])


def test_nothing_is_asked_of_a_mesh_without_requirements():
    check_requirements({}, ())


def test_an_empty_mesh_is_on_its_surface():
    empty = report("deviation", max=None, max_relative=None) | {"mesh": {"vertices": 0}}
    check_requirements(empty, ["on-surface"])
