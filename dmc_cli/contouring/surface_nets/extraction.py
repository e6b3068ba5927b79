"""Extract surface nets: the dual of the grid with vertices at the mean of their cells' crossings."""

from types import ModuleType

from dmc_cli.array_types import Float64Array
from dmc_cli.contouring.dual_grid import dual_kernels, extract_dual
from dmc_cli.contouring.surface import Reserve, Surface
from dmc_cli.contouring.surface_nets.mean_crossings import place_at_means
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
    return extract_dual(volume, settings, affine, even_slices, reserve, place_at_means)


def surface_kernels(_settings: SurfaceSettings) -> list[ModuleType]:
    """Return the modules whose kernels a surface needs, those that take longest to compile first."""
    from dmc_cli.contouring.surface_nets import mean_crossings

    return [mean_crossings, *dual_kernels()]
