"""The papers' rules are the oracle's and give the reference counts; the safe rules keep the mesh whole."""

from pathlib import Path

import numpy as np
import pytest
import warp as wp
from hypothesis import given

from dmc_cli.contouring import connect_faces
from dmc_cli.errors import SettingsError
from dmc_cli.measures.topology import measure_topology
from dmc_cli.mesh.check_halfedges import check_halfedges
from dmc_cli.mesh.halfedges import NO_TWIN
from dmc_cli.mesh.mesh import COLOR
from dmc_cli.mesh.working import working_mesh
from dmc_cli.processing.patterns.masks import list_3x3y
from dmc_cli.processing.patterns.removal_3x3y import remove_3x3y
from dmc_cli.processing.patterns.simplify_3x3y import choose_apart, choose_by_paper, judge_topology
from dmc_cli.settings import MeshSettings
from tests.contouring.dual_marching_cubes.agreement import extract_on
from tests.contouring.dual_marching_cubes.real import REAL_VOLUMES, read_real_volume
from tests.fields import (
    NON_MANIFOLD_ISOVALUES,
    non_manifold_volume,
    one_cell,
    one_inside_node,
    paper_field,
    plane,
    smooth_noise,
    white_noise,
)
from tests.mesh.meshes import (
    colored,
    euler_and_components,
    for_oracle,
    quad_normals,
    simplified,
    simplified_by_oracle,
    vertex_pair_uses,
)
from tests.oracle.halfedges import valences
from tests.reference import table
from tests.strategies import volumes_with_settings

SIMPLIFIED = [row for row in table("regression_counts.csv") if row["removed_colour"]]


def row_cases():
    for row in SIMPLIFIED:
        marks = [pytest.mark.slow] if int(row["n"]) >= 256 else []
        yield pytest.param(row, id=f"{row['field']}-{row['n']}", marks=marks)


def counts_of(result):
    return (
        *result.removed_3x3y,
        result.removed_3333,
        result.mesh.vertex_count,
        result.mesh.face_count,
    )


def expected_counts(row):
    names = ("removed_colour", "removed_counter", "removed_3333", "vertices_after", "quads_after")
    return tuple(int(row[name]) for name in names)


@pytest.mark.parametrize("row", list(row_cases()))
def test_the_papers_rules_remove_the_reference_counts(extract, row):
    surface = extract(paper_field.__wrapped__(row["field"], int(row["n"])), topology="asymptotic", threads=2)
    result = simplified(colored(surface), simplify_rules="paper", project=False)
    assert counts_of(result) == expected_counts(row)


@pytest.mark.real
@pytest.mark.parametrize("row", table("regression_real.csv"), ids=lambda row: Path(row["volume"]).name)
def test_the_papers_rules_remove_the_reference_counts_of_scans(extract, shared_data, row):
    name = row["volume"]
    volume = read_real_volume(shared_data, name)
    settings = {"topology": "asymptotic", "border": "closed", "threads": 2}
    mesh = colored(extract(volume, REAL_VOLUMES[name][0], **settings))
    result = simplified(mesh, simplify_rules="paper", project=False)
    assert counts_of(result) == expected_counts(row)


def assert_same_as_oracle(surface):
    mesh = colored(surface)
    expected = simplified_by_oracle(for_oracle(mesh))
    result = simplified(mesh, simplify_rules="paper", project=False)
    assert (*result.removed_3x3y, result.removed_3333) == expected.removed
    quads, twins, positions = expected.with_gaps_filled()
    np.testing.assert_array_equal(result.mesh.faces.numpy(), quads)
    np.testing.assert_array_equal(result.mesh.halfedges.twin.numpy(), twins)
    np.testing.assert_array_equal(
        result.mesh.halfedges.valence.numpy(), valences(quads, twins, len(positions))
    )
    return result, positions


@pytest.mark.parametrize("name", ["white noise", "smooth noise", "steiner", "12-Merge", "Iterative-Fix"])
@pytest.mark.parametrize("topology", ["manifold", "asymptotic"])
@pytest.mark.parametrize("border", ["open", "closed"])
def test_the_papers_rules_give_the_oracles_mesh(extract, name, topology, border):
    volume, isovalue = {
        "white noise": (lambda: (white_noise(16), 0.0)),
        "smooth noise": (lambda: (smooth_noise(24, 1.0), 0.0)),
        "steiner": (lambda: (paper_field("steiner", 32), 0.0)),
        "12-Merge": (lambda: (non_manifold_volume("12-Merge-iso-241.525"), 241.525)),
        "Iterative-Fix": (lambda: (non_manifold_volume("Iterative-Fix"), 900.0)),
    }[name]()
    surface = extract(volume, isovalue, topology=topology, border=border, threads=2)
    result, positions = assert_same_as_oracle(surface)
    scale = np.abs(positions).max()
    np.testing.assert_allclose(result.mesh.positions.numpy(), positions, atol=1e-6 * scale)


@given(volumes_with_settings())
def test_the_papers_rules_give_the_oracles_mesh_for_any_volume(volume_and_settings):
    assert_same_as_oracle(extract_on("cpu", *volume_and_settings))


NOISE = {
    "white": lambda: white_noise(24),
    "smooth": lambda: smooth_noise(40, 1.0),
    "smoother": lambda: smooth_noise(48, 2.0),
    "steiner": lambda: paper_field("steiner", 32),
    "neovius": lambda: paper_field("neovius", 64),
}


def assert_whole(before, result, uses_before):
    """Fail unless a simplified mesh is as sound as the one before it; returns its quads and twins."""
    quads, twin = result.mesh.faces.numpy(), result.mesh.halfedges.twin.numpy()
    check_halfedges(quads, twin, result.mesh.halfedges.vertex_halfedge.numpy())
    assert euler_and_components(quads, twin) == before
    assert (np.sort(quads, axis=1)[:, 1:] != np.sort(quads, axis=1)[:, :-1]).all(), "a vertex twice in a quad"
    uses = vertex_pair_uses(quads)
    assert (uses > 2).sum() <= (uses_before > 2).sum()
    return quads, twin


def duplicates(quads):
    return len(quads) - len(np.unique(np.sort(quads, axis=1), axis=0))


@pytest.mark.parametrize("name", NOISE)
@pytest.mark.parametrize("border", ["open", "closed"])
def test_the_safe_rules_keep_the_mesh_whole(extract, name, border):
    surface = extract(NOISE[name](), border=border, threads=2)
    mesh = colored(surface)
    old = for_oracle(mesh)
    before = euler_and_components(old.quads, old.twins)
    doublets = int((old.valences() < 3).sum())
    twice = duplicates(old.quads)
    result = simplified(mesh)
    assert result.removed_3x3y[0] > 0
    quads, twin = assert_whole(before, result, vertex_pair_uses(old.quads))
    valence = result.mesh.halfedges.valence.numpy()
    assert int((valence < 3).sum()) == doublets
    assert duplicates(quads) <= twice
    color = np.repeat(result.mesh.face_values[COLOR].numpy(), 4)
    with_twin = twin != NO_TWIN
    assert color.max() < 5 and (color[with_twin] != color[twin[with_twin]]).all()


@given(volumes_with_settings())
def test_the_safe_rules_keep_any_mesh_whole(volume_and_settings):
    volume, settings = volume_and_settings
    mesh = colored(extract_on("cpu", volume, settings))
    old = for_oracle(mesh)
    before = euler_and_components(old.quads, old.twins)
    result = simplified(mesh)
    quads, twin = result.mesh.faces.numpy(), result.mesh.halfedges.twin.numpy()
    one_fan = settings.topology == "manifold" or settings.border == "closed"
    check_halfedges(quads, twin, result.mesh.halfedges.vertex_halfedge.numpy(), one_fan=one_fan)
    assert euler_and_components(quads, twin) == before
    assert duplicates(quads) <= duplicates(old.quads)


def dots_of_a_sweep(surface, *, safe):
    """Normals before times normals after one sweep of 3-X-3-Y, for each quad that stays and had a normal."""
    mesh = colored(surface)
    work = working_mesh(mesh.mesh, mesh.placement)
    old_quads, old_positions = surface.mesh.faces.numpy().copy(), surface.mesh.positions.numpy().astype(float)
    quads = list_3x3y(work)
    state = work.device.zeros(work.face_count, wp.uint8)
    if safe:
        cuts, _ = choose_apart(work, judge_topology(work, quads, state)[0], state)
    else:
        cuts = choose_by_paper(work, quads, by_color=True)
    removed, _ = remove_3x3y(work, cuts, project=True, safe=safe, state=state)
    stays = work.arrays.face_gone.numpy() == 0
    assert int(removed.numpy().sum()) == int((~stays).sum())
    before = quad_normals(old_positions, old_quads)[stays]
    after = quad_normals(surface.mesh.positions.numpy().astype(float), surface.mesh.faces.numpy())[stays]
    return (before * after).sum(axis=1)[(before != 0).any(axis=1)]


def test_the_safe_rules_fold_no_quad_and_the_papers_do(extract):
    volume = white_noise(48)
    assert (dots_of_a_sweep(extract(volume, border="closed"), safe=False) < 0).any()
    assert (dots_of_a_sweep(extract(volume, border="closed"), safe=True) > 0).all()


@pytest.mark.parametrize("name", NOISE)
def test_no_sweep_of_the_safe_rules_folds_a_quad(extract, name):
    assert (dots_of_a_sweep(extract(NOISE[name](), border="closed"), safe=True) > 0).all()


def test_the_papers_rules_break_white_noise_and_the_safe_ones_do_not(extract):
    found = {}
    for rules in ("paper", "safe"):
        surface = extract(white_noise(48), border="closed", threads=2)
        result = simplified(colored(surface), simplify_rules=rules)
        found[rules] = measure_topology(result.mesh)
    assert found["safe"].non_manifold_edges == 0
    assert min(found["safe"].valence_histogram) == 3
    assert min(found["paper"].valence_histogram) < 3


def test_threads_do_not_show(extract):
    results = [simplified(colored(extract(smooth_noise(48, 1.0), threads=threads))) for threads in (1, 4)]
    one, four = results
    for get in (
        lambda r: r.mesh.faces,
        lambda r: r.mesh.positions,
        lambda r: r.placement.local,
        lambda r: r.mesh.halfedges.twin,
        lambda r: r.mesh.halfedges.vertex_halfedge,
        lambda r: r.mesh.face_values[COLOR],
    ):
        np.testing.assert_array_equal(get(one).numpy(), get(four).numpy())


SMALL = {
    "one cell": lambda: one_cell(0x81),
    "box": one_inside_node,
    "plane": plane,
    "single quad": lambda: plane(nodes=3, height=0.5),
    "empty": lambda: one_cell(0),
}


@pytest.mark.parametrize("name", SMALL)
@pytest.mark.parametrize("border", ["open", "closed"])
@pytest.mark.parametrize("rules", ["safe", "paper"])
@pytest.mark.parametrize("project", [True, False])
def test_small_surfaces_pass_unharmed(extract, name, border, rules, project):
    surface = extract(SMALL[name](), border=border)
    quads = surface.mesh.face_count
    result = simplified(colored(surface), simplify_rules=rules, project=project)
    assert result.mesh.face_count == quads
    check_halfedges(
        result.mesh.faces.numpy(),
        result.mesh.halfedges.twin.numpy(),
        result.mesh.halfedges.vertex_halfedge.numpy(),
    )


@pytest.mark.parametrize("name", NON_MANIFOLD_ISOVALUES)
def test_only_the_pattern_that_is_asked_for_goes(extract, name):
    settings = {"topology": "asymptotic", "border": "closed"}
    volume, isovalue = non_manifold_volume(name), NON_MANIFOLD_ISOVALUES[name]
    only_3x3y = simplified(colored(extract(volume, isovalue, **settings)), simplify="3x3y")
    only_3333 = simplified(colored(extract(volume, isovalue, **settings)), simplify="3333")
    assert only_3x3y.removed_3333 == 0
    assert only_3333.removed_3x3y == ()


def test_simplification_needs_no_colors_under_the_safe_rules(extract):
    volume = paper_field("genus_two", 32)
    surface = extract(volume)
    plain = simplified(connect_faces(surface))
    with_colors = simplified(colored(extract(volume)))
    assert COLOR not in plain.mesh.face_values
    np.testing.assert_array_equal(plain.mesh.faces.numpy(), with_colors.mesh.faces.numpy())


def test_settings_name_the_choices():
    with pytest.raises(SettingsError, match="simplify is 'most'; expected one of none"):
        MeshSettings(simplify="most")
