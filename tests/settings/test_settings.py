"""The ends of each range: the last value that is taken, and the first one that is refused."""

import math

import pytest

from dmc_cli.errors import SettingsError
from dmc_cli.settings import (
    ConvertSettings,
    MeasureSettings,
    MeshSettings,
    OutputSettings,
    ReadSettings,
    ReproduceSettings,
    SurfaceSettings,
    SynthSettings,
)

INFINITE = (math.inf, -math.inf, math.nan)


def output(**given):
    return OutputSettings(**{"path": "a.ply"} | given)


def surface(**given):
    return SurfaceSettings(**{"isovalue": 0.0} | given)


def synth(**given):
    return SynthSettings(**{"field": "noise", "path": "a.nrrd"} | given)


def measure(**given):
    return MeasureSettings(**{"mesh": "a.ply"} | given)


def converting(**given):
    return ConvertSettings(**{"input": "a", "surface": surface(), "output": output()} | given)


def triples(name, good, *bad):
    """Return a row of `RANGES` for each of the three places."""
    for place in range(3):
        others = [1.0 if name != "shape" else 1] * 3
        yield (
            ReadSettings,
            name,
            *((*others[:place], value, *others[place + 1 :]) for value in (good, *bad)),
        )


RANGES = [
    *triples("shape", 1, 0, -1),
    *triples("spacing", 5e-324, 0.0, -1.0, *INFINITE),
    *triples("origin", -1e300, *INFINITE),
    (ReadSettings, "skip_bytes", 0, -1),
    *((make, "seed", 0, -1) for make in (ReadSettings, synth)),
    *(
        (make, "sigma", edge, -1e-9, 10_000.5, *INFINITE)
        for make in (ReadSettings, synth)
        for edge in (0, 1e4)
    ),
    *((make, "threads", 1, 0, -1) for make in (ReadSettings, converting, measure, ReproduceSettings)),
    *((make, "threads", 4096, 4097) for make in (ReadSettings, converting, measure, ReproduceSettings)),
    *((make, "device", "cuda:0", "gpu") for make in (converting, measure, ReproduceSettings)),
    (synth, "nodes", 2, 1),
    (synth, "path", "-", "", "a\0"),
    (surface, "isovalue", -1e300, *INFINITE),
    (MeshSettings, "remesh", 0, -1),
    (MeshSettings, "relax", 0, -1),
    (output, "memory", 1, 0),
    *((output, name, "-", "", "a\0") for name in ("halfedges", "report")),
    (output, "path", "-", "", "a\0"),
    (converting, "input", "-", "a\0"),
    (measure, "mesh", "-", "a\0"),
    (measure, "volume", "-", "a\0"),
    (ReproduceSettings, "up_to", 1, 0),
]


@pytest.mark.parametrize(("make", "name", "good", "bad"), [(*row[:3], row[3:]) for row in RANGES])
def test_the_last_value_is_taken_and_the_first_one_beyond_is_refused(make, name, good, bad):
    assert getattr(make(**{name: good}), name) == good
    for value in bad:
        with pytest.raises(SettingsError, match="; expected "):
            make(**{name: value})


def test_an_isovalue_to_measure_at_is_finite_and_has_a_volume():
    assert measure(volume="v", isovalue=1).isovalue == 1
    assert measure(volume="v").isovalue is None
    for value in INFINITE:
        with pytest.raises(SettingsError, match="expected a finite number"):
            measure(volume="v", isovalue=value)
    with pytest.raises(SettingsError, match=r"isovalue 1 was given, but no volume"):
        measure(isovalue=1)


@pytest.mark.parametrize(
    ("given", "is_refused"),
    [
        ({}, False),
        ({"simplify_rules": "paper"}, True),
        ({"project": False}, True),
        ({"simplify_rules": "paper", "project": False}, True),
    ],
)
@pytest.mark.parametrize("simplify", ["none", "3x3y", "3333", "all"])
def test_remeshing_needs_safe_rules_and_vertices_on_the_surface(simplify, given, is_refused):
    assert MeshSettings(simplify=simplify, **given).is_changed == (simplify != "none")
    if is_refused:
        cause = "simplify_rules is 'paper'" if "simplify_rules" in given else "project is off"
        with pytest.raises(SettingsError, match=f"remesh is 20, but {cause}"):
            MeshSettings(simplify=simplify, remesh=20, **given)


@pytest.mark.parametrize("simplify", ["none", "all"])
def test_remeshing_implies_all_patterns(simplify):
    assert MeshSettings(simplify=simplify, remesh=1).simplify == "all"


@pytest.mark.parametrize("simplify", ["3x3y", "3333"])
def test_remeshing_goes_on_from_all_patterns_only(simplify):
    with pytest.raises(SettingsError, match=f"remesh is 2, but simplify is '{simplify}'"):
        MeshSettings(simplify=simplify, remesh=2)


def test_smoothing_changes_the_mesh_too():
    assert not MeshSettings().is_changed
    assert MeshSettings(relax=1).is_changed
    assert converting(mesh=MeshSettings(relax=1)).needs_halfedges


@pytest.mark.parametrize(
    ("given", "is_measured", "needs_halfedges"),
    [
        ({}, False, False),
        ({"report": "-"}, True, True),
        ({"require": ("closed",)}, True, True),
        ({"check": True}, True, True),
        ({"halfedges": "h.npz"}, False, True),
        ({"dry_run": True, "normals": False}, False, False),
    ],
)
def test_what_an_output_needs(given, is_measured, needs_halfedges):
    settings = converting(output=output(**given))
    assert (settings.output.is_measured, settings.needs_halfedges) == (is_measured, needs_halfedges)


@pytest.mark.parametrize("streamed", [("path", "halfedges"), ("path", "report"), ("halfedges", "report")])
def test_standard_output_is_one_output(streamed):
    with pytest.raises(SettingsError, match="are both sent to standard output"):
        output(**dict.fromkeys(streamed, "-"))
    for name in streamed:
        output(**{name: "-"})
