"""Extract a surface by dual contouring: the dual of the grid, its vertices placed as the settings choose."""

from types import ModuleType

from dmc_cli.array_types import Float64Array
from dmc_cli.contouring.dual_grid import PlaceCells, dual_kernels, extract_dual
from dmc_cli.contouring.surface import Reserve, Surface
from dmc_cli.field import DeviceVolume
from dmc_cli.settings import SurfaceSettings


def extract(
    volume: DeviceVolume,
    settings: SurfaceSettings,
    affine: Float64Array | None,
    even_slices: bool,
    reserve: Reserve | None,
) -> Surface:
    """Extract the isosurface as quads; the arguments are those of `extract_surface`."""
    return extract_dual(volume, settings, affine, even_slices, reserve, _placing(settings))


def _placing(settings: SurfaceSettings) -> PlaceCells:
    """Return the way to place vertices that is chosen; the kernels of others are not even read."""
    if settings.gradients == "exact":
        from dmc_cli.contouring.dual_contouring.exact_gradients import place_by_gradients

        return place_by_gradients
    if settings.placement == "paper":
        from dmc_cli.contouring.dual_contouring.paper import place_as_paper

        return place_as_paper
    from dmc_cli.contouring.dual_contouring.placement import place_by_planes

    return place_by_planes


def surface_kernels(settings: SurfaceSettings) -> list[ModuleType]:
    """Return the modules whose kernels a surface needs, those that take longest to compile first."""
    if settings.gradients == "exact":
        from dmc_cli.contouring.dual_contouring import exact_gradients

        return [exact_gradients, *dual_kernels()]
    if settings.placement == "paper":
        from dmc_cli.contouring.dual_contouring import paper

        return [paper, *dual_kernels()]
    from dmc_cli.contouring.dual_contouring import placement, single_cells

    return [placement, single_cells, *dual_kernels()]
