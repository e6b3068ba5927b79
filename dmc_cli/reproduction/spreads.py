"""Make what the papers' figures show, on the largest data set that is chosen: each value of each mesh.

Theirs are of a skull that was never published, but for the deviation on iWP. Curves keep their shape there:
what they tell of methods is true of the field as well.
"""

from dataclasses import dataclass

import numpy as np

from dmc_cli.array_types import Float64Array
from dmc_cli.contouring import color_faces, connect_faces, extract_surface
from dmc_cli.errors import SettingsError
from dmc_cli.field import upload_volume
from dmc_cli.measures import inspect_vertices, list_deviation, list_elements
from dmc_cli.mesh import Mesh, Placement
from dmc_cli.processing import simplify
from dmc_cli.progress import SILENT, Progress
from dmc_cli.reproduction.paper_tables import GENUS_TWO_64, GENUS_TWO_128, GENUS_TWO_256, IWP_512
from dmc_cli.reproduction.paper_values import DUAL, MARCHING, DataSet
from dmc_cli.reproduction.reproduce import SyntheticMesh, field_values
from dmc_cli.reproduction.reproduce_run import (
    OTHERS,
    PAPER_RULES,
    load_reproduction,
    papers_settings,
    wanted_values,
)
from dmc_cli.runtime import Device, select_device
from dmc_cli.settings import MeshSettings, ReadSettings, ReproduceSettings
from dmc_cli.volume_io import synthetic_volume

PLACED = {"mean of polygon": "centroid", "iterative (2020)": "iterative", "sampled (2021)": "sampled"}
"""Ways to place vertices, and their placements."""

DRAWN = (GENUS_TWO_64, GENUS_TWO_128, GENUS_TWO_256, IWP_512)
"""Data sets of tables 6 to 8, of which the largest is drawn."""


@dataclass(frozen=True)
class Spreads:
    """What the figures show, by the papers' names of the meshes.

    Attributes:
        data: The data set.
        triangles: Equation 8 of each triangle, quads split by the MaxMin-angle criterion.
        quads: Equation 9 of each quad.
        deviations: |f| at each vertex, f the field's formula.
        projections: Deviation from the isovalue by the trilinear interpolant, as a share of the range of
            values, of vertices at the mean of their polygon, and of vertices moved from there.
        valences: Number of vertices by valence, before simplification and after each pass.
    """

    data: DataSet
    triangles: dict[str, Float64Array]
    quads: dict[str, Float64Array]
    deviations: dict[str, Float64Array]
    projections: dict[str, Float64Array]
    valences: dict[str, dict[int, int]]


def drawn_data(settings: ReproduceSettings) -> DataSet:
    """Return the data set that figures are drawn of: the largest that is made for the chosen tables.

    Raises:
        SettingsError: None that figures show is made.
    """
    made = {value.data for value in wanted_values(settings)}
    chosen = [data for data in DRAWN if data in made]
    if not chosen:
        known = ", ".join(data.name for data in DRAWN)
        raise SettingsError(
            f"figures were asked for, but none of the data sets that they show is made ({known}); choose"
            " another table or a larger --up-to, or leave --figures out"
        )
    return chosen[-1]


def gather_spreads(settings: ReproduceSettings, progress: Progress = SILENT) -> Spreads:
    """Return what the figures show.

    Raises:
        SettingsError: None of the data sets that figures show is made.
        DeviceError: There is no such device, or not enough memory on it.
    """
    device = select_device(settings.device, settings.threads)
    load_reproduction(device, settings.placement, progress)
    with progress.stage("drawing"):
        return spreads_of(drawn_data(settings), settings.placement, device)


def spreads_of(data: DataSet, placement: str, device: Device) -> Spreads:
    """Return what the figures show of a data set."""
    volume = upload_volume(synthetic_volume(f"synth:{data.field}:{data.nodes}", ReadSettings()), device)
    found = Spreads(data, {}, {}, {}, {}, {})

    def add(name: str, mesh: Mesh, placed: Placement) -> None:
        elements = list_elements(mesh)
        found.triangles[name] = elements["mean_ratio"].reshape(-1)
        if not mesh.triangle_count:
            found.quads[name] = elements["shape"]
        found.deviations[name] = _deviations(data, mesh, placed)

    for label, patterns in (("before", "none"), ("after 3-X-3-Y", "3x3y"), ("after 3-3-3-3", "all")):
        surface = color_faces(connect_faces(extract_surface(volume, papers_settings(placement))))
        mesh, placed = surface.mesh, surface.placement
        if patterns == "none":
            add("DMC", mesh, placed)
        else:
            rules = MeshSettings(simplify=patterns, simplify_rules="paper", project=False)  # type: ignore[arg-type]
            result = simplify(mesh, placed, rules)
            mesh, placed = result.mesh, result.placement
        if patterns == PAPER_RULES.simplify:
            add("DMCS", mesh, placed)
        valence, count = np.unique(inspect_vertices(mesh).valences, return_counts=True)
        found.valences[label] = dict(zip(valence.tolist(), count.tolist(), strict=True))
    for name, kind in (("DC", DUAL), ("MC", MARCHING)):
        surface = extract_surface(volume, OTHERS[kind])
        add(name, surface.mesh, surface.placement)
    low, high = volume.volume.value_range() or (0.0, 1.0)
    for name, way in PLACED.items():
        placed = extract_surface(volume, papers_settings(way)).placement
        found.projections[name] = list_deviation(placed, volume.volume) / (high - low)
    return found


def _deviations(data: DataSet, mesh: Mesh, placed: Placement) -> Float64Array:
    """Return |f| at each vertex."""
    return field_values(SyntheticMesh(data=data, mesh=mesh, placement=placed, unused_vertices=0))
