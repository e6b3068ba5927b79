"""A method is a folder and a line of the registry: those that are there, and two toys with a line each."""

import json
import subprocess
import sys
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from dmc_cli.app import conversion, convert
from dmc_cli.contouring import color_faces, every_kernel_module, kernel_modules, mesh_kernel_modules
from dmc_cli.errors import MemoryBudgetError, SettingsError
from dmc_cli.methods import METHODS, method_named, option_values
from dmc_cli.settings import ConvertSettings, MeshSettings, OutputSettings, ReproduceSettings, SurfaceSettings
from tests import toy_methods

ROOT = Path(__file__).parents[1]
SCHEMA = json.loads((ROOT / "docs/report-schema.json").read_text("utf-8"))


@pytest.fixture
def toys(monkeypatch):
    for name, place in toy_methods.LINES.items():
        monkeypatch.setitem(METHODS, name, place)


def settings_of(folder, method, *, surface=None, mesh=None, **output):
    return ConvertSettings(
        input="synth:sphere:12",
        surface=SurfaceSettings(isovalue=0.0, method=method, **(surface or {})),
        mesh=MeshSettings(**(mesh or {})),
        output=OutputSettings(path=str(folder / "a.ply"), **output),
        device="cpu",
        threads=2,
    )


def run_with_toys(*words):
    command = [sys.executable, "-m", "tests.toy_methods", *map(str, words)]
    return subprocess.run(command, capture_output=True, encoding="utf-8", timeout=200, check=False, cwd=ROOT)


@pytest.mark.parametrize("name", METHODS)
def test_a_method_says_what_it_is_and_needs(name):
    method = method_named(name)
    assert method.title
    settings = SurfaceSettings(isovalue=0.0, method=name)
    assert set(method.kernels(settings)) <= set(kernel_modules(settings))
    for option, values in method.options.items():
        assert getattr(settings, option) == values[0]
        for value in values:
            chosen = SurfaceSettings(isovalue=0.0, method=name, **{option: value})
            assert set(kernel_modules(chosen)) <= set(every_kernel_module())


def test_the_default_and_its_defaults():
    settings = SurfaceSettings(isovalue=0.0)
    assert next(iter(METHODS)) == settings.method == "dmc"
    assert (settings.topology, settings.placement, settings.border) == ("manifold", "exact", "open")
    assert method_named("dmc").options["placement"] == ("exact", "sampled", "iterative", "centroid")
    assert option_values("placement")[:4] == method_named("dmc").options["placement"]


def test_other_methods_are_refused_with_the_list(run, tmp_path):
    result = run("convert", "synth:torus:8", tmp_path / "a.ply", "-i", 0, "--method", "cubes")
    assert result.exit_code == 2
    assert f"method is 'cubes'; expected one of {', '.join(METHODS)}\n" in result.stderr
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(SettingsError, match=f"method is 'cubes'; expected one of {', '.join(METHODS)}"):
        SurfaceSettings(isovalue=0.0, method="cubes")


@pytest.mark.parametrize("owner", [SurfaceSettings, ReproduceSettings])
def test_other_placements_are_refused_with_the_list(owner):
    needed = {"isovalue": 0.0} if owner is SurfaceSettings else {}
    with pytest.raises(SettingsError, match="placement is 'middle'; expected one of exact, sampled"):
        owner(placement="middle", **needed)


def test_the_report_names_the_method(run, tmp_path):
    words = ("-i", 0, "--method", "dmc", "--report", tmp_path / "a.json")
    assert run("convert", "synth:torus:8", tmp_path / "a.ply", *words).exit_code == 0
    assert json.loads((tmp_path / "a.json").read_text())["surface"]["method"] == "dmc"


@pytest.mark.parametrize(("method", "kind"), [("toy", "quads"), ("cut", "triangles")])
def test_a_method_that_is_added_by_a_line_converts(toys, tmp_path, method, kind):
    settings = settings_of(tmp_path, method, check=True, report=str(tmp_path / "a.json"))
    result = convert(settings)
    report = json.loads((tmp_path / "a.json").read_text())
    jsonschema.validate(report, SCHEMA)
    other = {"quads": "triangles", "triangles": "quads"}[kind]
    assert (report["mesh"][kind], report["mesh"][other]) == (len(result.mesh.faces), 0)
    assert report["mesh"][kind] > 100
    assert report["surface"]["active_cells"] == report["mesh"]["vertices"] == len(result.mesh.points)
    assert report["surface"]["polygons"] is report["surface"]["flipped_faces"] is None
    assert report["settings"]["placement"] == {"toy": "middle", "cut": None}[method]
    assert report["settings"]["topology"] is report["settings"]["border"] is None
    topology = report["topology"]
    assert (topology["genus"], topology["boundary_edges"], topology["components"]) == (0, 0, 1)
    assert 0.8 < report["mesh"]["volume"] / (4 / 3 * np.pi * 0.75**3) < 1.2


def test_the_stages_after_contouring_take_the_mesh_of_any_method(toys, tmp_path):
    mesh = {"simplify": "all", "remesh": 1, "relax": 1}
    report = convert(settings_of(tmp_path, "toy", mesh=mesh, require=("manifold", "closed"))).report
    assert report["simplification"]["rounds"] == 1
    assert report["quality"]["shape_mean"] > 0.5


def test_the_option_of_a_method_is_heeded(toys, tmp_path):
    low, middle = (
        convert(settings_of(tmp_path, "toy", surface=surface, force=True)).mesh.points
        for surface in ({"placement": "low"}, {})
    )
    np.testing.assert_allclose(middle - low, 0.25 * 2 / 11, rtol=1e-4)


@pytest.mark.parametrize(
    ("method", "parts", "found"),
    [
        ("toy", {"surface": {"topology": "manifold"}}, "topology is 'manifold', but the method toy has no"),
        ("toy", {"surface": {"border": "open"}}, "leave it out, or choose a method that has it: dmc"),
        ("toy", {"surface": {"placement": "exact"}}, "'exact'; expected one of middle, low"),
        ("cut", {"surface": {"placement": "exact"}}, "has it: dmc, .*toy"),
        ("toy", {"mesh": {"simplify": "all", "simplify_rules": "paper"}}, "simplify_rules is 'paper', but"),
        (
            "cut",
            {"mesh": {"simplify": "3x3y"}},
            "simplify is '3x3y', .* makes triangles; .*: dmc, .*toy",
        ),
        ("cut", {"mesh": {"remesh": 3}}, "remesh is 3, but"),
        ("cut", {"mesh": {"relax": 2}}, "relax is 2, but"),
        ("dmc", {"surface": {"placement": "low"}}, "'low'; expected one of exact,"),
    ],
)
def test_what_a_method_does_not_take_is_refused_as_the_settings_are_made(
    toys, tmp_path, method, parts, found
):
    with pytest.raises(SettingsError, match=found):
        settings_of(tmp_path, method, **parts)


def test_colours_of_a_method_without_any_are_refused(toys, tmp_path, monkeypatch):
    surfaces = []
    extract = conversion.extract_surface

    def extracted(*arguments, **named):
        surfaces.append(extract(*arguments, **named))
        return surfaces[-1]

    monkeypatch.setattr(conversion, "extract_surface", extracted)
    convert(settings_of(tmp_path, "toy"))
    with pytest.raises(SettingsError, match="the method toy colours no faces; expected one that does: dmc"):
        color_faces(surfaces[0])


def test_a_forecast_is_of_the_arrays_that_the_method_declares(toys, tmp_path):
    shown = "the volume and a mesh of [0-9]+ triangles need"
    with pytest.raises(MemoryBudgetError, match=shown):
        convert(settings_of(tmp_path, "cut", memory=20_000))
    convert(settings_of(tmp_path, "cut", memory=120_000))
    with pytest.raises(MemoryBudgetError, match=r"a mesh of [0-9]+ quads need"):
        convert(settings_of(tmp_path, "toy", memory=50_000, force=True))
    assert not mesh_kernel_modules("toy")[0].__name__.startswith("dmc_cli.contouring")


def test_the_command_line_knows_a_method_by_its_line(tmp_path):
    shown = " ".join(run_with_toys("convert", "--help").stdout.split())
    assert "dmc (dual marching cubes), " in shown
    assert ", toy (toy surface nets), cut (toy triangles)." in shown
    assert f"[{'|'.join(option_values('placement'))}|middle|low]" in shown
    assert "Of dmc: exact (default), sampled, iterative, centroid. " in shown
    assert " Of toy: middle (default), low." in shown
    words = ["convert", "synth:sphere:12", tmp_path / "a.obj", "-i", 0, "--method", "cut"]
    refused = run_with_toys(*words, "--border", "open")
    assert refused.returncode == 2
    assert "border is 'open', but the method cut has no such option" in refused.stderr
    assert list(tmp_path.iterdir()) == []
    made = run_with_toys(*words)
    assert made.returncode == 0, made.stderr
    assert " vertices, 0 quads, " in made.stderr
    assert (tmp_path / "a.obj").read_text().count("\nf ") > 100
