"""A run loads the modules whose kernels it launches, before it begins, and few others."""

import pytest
import warp as wp

from dmc_cli.app.conversion import _needed_kernels, convert
from dmc_cli.runtime import launch_kernels
from dmc_cli.runtime.device import Device
from dmc_cli.settings import ConvertSettings, MeshSettings, OutputSettings, SurfaceSettings

ALWAYS = {module.__name__ for module in launch_kernels()}
RUNS = {
    "plain": ({}, {}),
    "no normals": ({"normals": False}, {}),
    "dump": ({"normals": False, "halfedges": "h.npz"}, {}),
    "report": ({"report": "r.json"}, {}),
    "walls": ({"report": "r.json", "wall": 1.0}, {}),
    "values": ({"values": ("quality", "deviation", "valence")}, {}),
    "patterns": ({}, {"simplify": "all"}),
    "patterns with colours": ({"halfedges": "h.npz"}, {"simplify": "all"}),
    "relaxed": ({}, {"relax": 2}),
    "remeshed": ({}, {"remesh": 3}),
    "decimated": ({}, {"quads": "50%"}),
}
LEFT_OUT = {
    "plain": {"halfedges", "mesh", "processing", "measures"},
    "no normals": {"halfedges", "mesh", "processing", "measures", "normals"},
    "dump": {
        "simplify_3x3y",
        "relax",
        "sweep",
        "measures",
    },
    "report": {
        "simplify_3x3y",
        "relax",
        "coloring",
        "sweep",
    },
    "values": {"processing", "coloring", "topology", "components"},
    "patterns": {"relax", "sweep", "quality"},
    "relaxed": {
        "simplify_3x3y",
        "coloring",
        "sweep",
        "quality",
    },
    "remeshed": {"quality"},
    "decimated": {"simplify_3x3y", "mend", "quality"},
}


def settings_of(name, folder, placement="exact"):
    output, mesh = RUNS[name]
    named = {key: str(folder / value) if isinstance(value, str) else value for key, value in output.items()}
    return ConvertSettings(
        input="synth:noise:12",
        surface=SurfaceSettings(isovalue=0.5, placement=placement),
        output=OutputSettings(path=str(folder / "a.ply"), **named),
        mesh=MeshSettings(**mesh),
        device="cpu",
        threads=2,
    )


@pytest.fixture
def launched(monkeypatch):
    """The modules of all kernels that are launched."""
    found = set()

    def spy(owner, name):
        real = getattr(owner, name)

        def call(*arguments, **options):
            kernel = options.get("kernel") or next(a for a in arguments if isinstance(a, wp.Kernel))
            found.add(kernel.module.name)
            return real(*arguments, **options)

        monkeypatch.setattr(owner, name, call)

    for owner, name in ((Device, "launch"), (Device, "begin"), (wp, "launch")):
        spy(owner, name)
    return found


@pytest.mark.parametrize("name", RUNS)
def test_what_is_launched_was_loaded_before(launched, tmp_path, name):
    settings = settings_of(name, tmp_path)
    needed = {module.__name__ for module in _needed_kernels(settings)}
    convert(settings)
    assert launched - ALWAYS <= needed


@pytest.mark.parametrize("placement", ["sampled", "iterative", "centroid"])
def test_other_placements_are_loaded_before(launched, tmp_path, placement):
    settings = settings_of("plain", tmp_path, placement)
    convert(settings)
    assert launched - ALWAYS <= {module.__name__ for module in _needed_kernels(settings)}


@pytest.mark.parametrize("name", LEFT_OUT)
def test_what_a_run_does_not_need_is_not_loaded(tmp_path, name):
    needed = {
        module.__name__.removeprefix("dmc_cli.") for module in _needed_kernels(settings_of(name, tmp_path))
    }
    loaded = {part for module in needed for part in module.split(".")}
    assert loaded.isdisjoint(LEFT_OUT[name])
