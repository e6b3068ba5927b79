"""What holds of every method of the registry, on any volume: what it promises, and the same bytes by all.

A new method falls in by its line of the registry.
"""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings

from dmc_cli.contouring import compute_normals, extract_surface
from dmc_cli.errors import EmptySurfaceError
from dmc_cli.field import upload_volume
from dmc_cli.methods import METHODS, method_named
from dmc_cli.runtime.device import Device, select_device
from dmc_cli.settings import SurfaceSettings
from tests.contouring.dual_marching_cubes.agreement import as_arrays, extract_on
from tests.contouring.dual_marching_cubes.test_extreme_values import extreme_volumes
from tests.fields import smooth_noise, sphere, volume_of, white_noise
from tests.oracle.edges import pinched_vertices
from tests.oracle.grid import cut_grid
from tests.oracle.trilinear import distances_at
from tests.other_hardware import AsOnGpu
from tests.strategies import volumes_with_settings

SHARED = ("isovalue", "inside", "border", "orientation")
"""What all methods take."""


def choices():
    """Each method as it is, and with each further value of one of its own options."""
    found = []
    for name in METHODS:
        found.append({"method": name})
        for option, values in method_named(name).options.items():
            if option not in ("border", "gradients"):
                found += [{"method": name, option: value} for value in values[1:]]
    return [pytest.param(choice, id="-".join(choice.values())) for choice in found]


@pytest.fixture(params=choices())
def choice(request):
    return request.param


def corner_lists(surface):
    """The corners of the faces, (F, 3) or (F, 4)."""
    faces = surface.mesh.faces.numpy()
    return faces[:, :3] if surface.mesh.triangle_count else faces


def side_counts(corners, count):
    """The sides as they run, and how often each does: directed (n, 2), counts (n,)."""
    sides = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2).astype(np.int64)
    found, counts = np.unique(sides @ [count, 1], return_counts=True)
    return np.stack([found // count, found % count], axis=1), counts


def assert_sound(surface, chosen):
    """Fail unless the mesh is what its method promises."""
    method, count = method_named(chosen.method), len(surface.placement.cell)
    local, faces = surface.placement.local.numpy(), surface.mesh.faces.numpy()
    assert ((local >= 0) & (local <= 1)).all()
    assert np.isfinite(surface.mesh.positions.numpy()).all()
    assert (faces[:, 3] == -1).all() if method.faces == "triangles" else (faces >= 0).all()
    assert surface.mesh.triangle_count == (len(faces) if method.faces == "triangles" else 0)
    if len(faces) == 0:
        assert count == 0
        return
    corners = corner_lists(surface)
    np.testing.assert_array_equal(np.unique(corners), np.arange(count))
    assert (np.diff(np.sort(corners, axis=1), axis=1) > 0).all(), "a face names a vertex twice"
    sides, counts = side_counts(corners, count)
    back = {(a, b): n for (a, b), n in zip(sides.tolist(), counts.tolist(), strict=True)}
    if chosen.border == "closed":
        assert all(back.get((b, a)) == n for (a, b), n in back.items()), "the mesh has a boundary"
    if chosen.is_manifold:
        assert counts.max() == 1, "two faces run the same way along a side"
        assert not pinched_vertices(corners, count).any()


def assert_on_surface(surface, volume, chosen):
    """Fail unless the vertices are on the trilinear surface, if that is promised."""
    if not chosen.is_on_surface or surface.counts.fallback_vertices or len(surface.placement.cell) == 0:
        return
    grid = cut_grid(volume, chosen)
    filled = np.where(grid.data, grid.distance, 0.0)
    away = distances_at(
        type(grid)(filled, grid.data, grid.padded), surface.placement.cell.numpy(), local_of(surface)
    )
    assert np.abs(away).max() <= 1e-5 * np.abs(filled).max()


def local_of(surface):
    return surface.placement.local.numpy()


def assert_same_by_all(volume, chosen):
    """Fail unless several threads, and the branches of a GPU, make the same bytes."""
    one = extract_on("cpu", volume, chosen)
    for device in (select_device("cpu", 3), Device("cpu", 2), AsOnGpu("cpu", 1)):
        other = extract_surface(upload_volume(volume, device), chosen)
        assert other.counts == one.counts
        for name, array in as_arrays(one).items():
            assert array.tobytes() == as_arrays(other)[name].tobytes(), (name, device)
    return one


EXAMPLES = 12 * settings.default.max_examples // 60
QUIET = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow]


@settings(max_examples=EXAMPLES, suppress_health_check=QUIET)
@given(drawn=volumes_with_settings())
def test_any_small_volume(choice, drawn):
    volume, given_settings = drawn
    chosen = SurfaceSettings(**choice, **{name: getattr(given_settings, name) for name in SHARED})
    surface = assert_same_by_all(volume, chosen)
    assert_sound(surface, chosen)
    assert_on_surface(surface, volume, chosen)


@settings(max_examples=EXAMPLES, suppress_health_check=QUIET)
@given(drawn=extreme_volumes())
def test_any_value_of_any_type(choice, drawn):
    volume, given_settings = drawn
    chosen = SurfaceSettings(**choice, **{name: getattr(given_settings, name) for name in SHARED})
    assume(math.isfinite(chosen.isovalue))
    try:
        surface = assert_same_by_all(volume, chosen)
    except EmptySurfaceError:
        return
    assert_sound(surface, chosen)


@pytest.mark.parametrize("border", ["open", "closed"])
@pytest.mark.parametrize("share", [0.0, 0.1])
def test_noise_of_several_words(choice, share, border):
    rng = np.random.default_rng(6)
    values = rng.standard_normal((7, 8, 70)).astype(np.float32)
    values[rng.random(values.shape) < share] = np.nan
    volume, chosen = volume_of(values), SurfaceSettings(isovalue=0.1, border=border, **choice)
    surface = assert_same_by_all(volume, chosen)
    assert_sound(surface, chosen)
    assert_on_surface(surface, volume, chosen)


@pytest.mark.parametrize("inside", ["above", "below"])
@pytest.mark.parametrize("orientation", ["outward", "gradient"])
@pytest.mark.parametrize("affine", [np.eye(4), np.diag([1.0, -2.0, 3.0, 1.0])], ids=["plain", "mirrored"])
def test_faces_look_the_way_that_is_asked(choice, inside, orientation, affine):
    """Out of the object or along the gradient: into a ball where all but the ball is the object."""
    volume = volume_of(sphere(14).values, affine=affine)
    chosen = SurfaceSettings(isovalue=0.0, inside=inside, orientation=orientation, **choice)
    surface = extract_on("cpu", volume, chosen)
    points, corners = surface.mesh.positions.numpy().astype(float), corner_lists(surface)
    middle = (affine @ [6.5, 6.5, 6.5, 1])[:3]
    a, b, c = (points[corners[:, n]] - middle for n in range(3))
    outwards = np.einsum("fc,fc->f", a, np.cross(b, c)) > 0
    expected = orientation == "outward" and inside == "above"
    assert (outwards == expected).all()
    normals = compute_normals(surface.placement, chosen).numpy()
    assert (np.einsum("vc,vc->v", normals, points - middle) > 0).all() == expected


@pytest.mark.parametrize("make", [lambda: white_noise(33), lambda: smooth_noise(36)], ids=["white", "smooth"])
def test_the_same_bytes_by_all_of_larger_volumes(choice, make):
    assert_same_by_all(make(), SurfaceSettings(isovalue=0.0, border="closed", **choice))
