"""Extract the surface of a volume, connect its faces and colour them, by whichever method."""

from dataclasses import replace

from dmc_cli.array_types import Float64Array
from dmc_cli.contouring.surface import Reserve, Surface
from dmc_cli.errors import CallError, SettingsError
from dmc_cli.field import DeviceVolume
from dmc_cli.methods import method_named, methods_that
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume import intact


def extract_surface(
    volume: DeviceVolume,
    settings: SurfaceSettings,
    affine: Float64Array | None = None,
    *,
    even_slices: bool = False,
    reserve: Reserve | None = None,
) -> Surface:
    """Extract the isosurface of a volume by the method that is set.

    Args:
        volume: Values on the device.
        settings: Method, isovalue, side, topology, border, orientation.
        affine: Shape (4, 4): node index to the space that vertices are wanted in; the volume's own if None.
        even_slices: Leave slice positions aside, as grid coordinates do.
        reserve: Called with what is known before memory for it is taken, once or several times; it may raise.

    Raises:
        DeviceError: More vertices or quads than 32-bit mesh indices can number.
        DamagedVolumeError: The file that holds the values shrank meanwhile.
        CallError: The volume is not on a device.
    """
    if not isinstance(volume, DeviceVolume):
        raise CallError(
            f"a {type(volume).__name__} was found; expected a volume on a device; call"
            " upload_volume(volume, device) first"
        )
    device = volume.device
    device.wake()
    extract = method_named(settings.method).extract
    with intact(volume.volume.values, volume.volume.path):
        try:
            surface: Surface = extract(volume, settings, affine, even_slices, reserve)
        except BaseException:
            device.drop()
            raise
        device.finish()
    return surface


def connect_faces(surface: Surface) -> Surface:
    """Return the surface with halfedges, as its method finds them, else as those of any mesh are found.

    Raises:
        CallError: It is no surface, or its mesh is no longer the one that was extracted.
    """
    _require_surface(surface)
    own = method_named(surface.method).connect
    if own is not None:
        connected: Surface = own(surface)
        return connected
    from dmc_cli.mesh import connect  # only here: kernels that others need not read

    return replace(surface, mesh=connect(surface.mesh))


def color_faces(surface: Surface) -> Surface:
    """Return a connected surface with colours of its faces, as its method finds them.

    Raises:
        CallError: It is no surface, its faces are not connected by `connect_faces`, or its mesh is no longer
            the one that was extracted.
        SettingsError: The method has no colours.
    """
    _require_surface(surface)
    color = method_named(surface.method).color
    if color is None:
        raise SettingsError(
            f"the method {surface.method} colours no faces; expected one that does:"
            f" {', '.join(methods_that(lambda method: method.color is not None))}"
        )
    colored: Surface = color(surface)
    return colored


def _require_surface(surface: Surface) -> None:
    """Raise CallError unless it is a surface."""
    if not isinstance(surface, Surface):
        raise CallError(
            f"a {type(surface).__name__} was found; expected the Surface that extract_surface returns,"
            " which knows the grid; connect a mesh alone by connect(mesh)"
        )
