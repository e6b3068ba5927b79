"""Extract the surface of a volume, connect its faces and colour them, by whichever method."""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np

from dmc_cli.array_types import Float64Array, IntArray
from dmc_cli.contouring.surface import Reserve, Surface
from dmc_cli.errors import CallError, SettingsError
from dmc_cli.field import DeviceVolume
from dmc_cli.methods import method_named, methods_that
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume import intact

Result = TypeVar("Result")


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
    extract = method_named(settings.method).extract
    surface: Surface = _finished(volume, lambda: extract(volume, settings, affine, even_slices, reserve))
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


def list_tunnels(volume: DeviceVolume, settings: SurfaceSettings) -> IntArray:
    """Return the cells in which the trilinear surface has a tunnel, int64 (n, 3): lowest nodes i j k.

    Indices are the volume's: -1 is the layer that a closed border adds.

    Raises:
        SettingsError: The method does not form tunnels.
    """
    find = method_named(settings.method).list_tunnels
    if find is None:
        known = methods_that(lambda method: method.list_tunnels is not None)
        raise SettingsError(
            f"the method {settings.method} forms no tunnels inside cells; expected one that does:"
            f" {', '.join(known)}"
        )
    tunnels: IntArray = _finished(volume, lambda: find(volume, settings))
    return tunnels


def list_flips(volume: DeviceVolume, settings: SurfaceSettings) -> IntArray:
    """Return the faces that the method decides otherwise to be manifold, int64 (n, 4): cell, axis.

    A face is the high one of the cell. Each closes a tunnel through two cells or, seen from the other side,
    cuts a bridge. There are none where the method leaves all decisions as they are.
    """
    find = method_named(settings.method).list_flips
    if find is None:
        return np.empty((0, 4), np.int64)
    flips: IntArray = _finished(volume, lambda: find(volume, settings))
    return flips


def _finished(volume: DeviceVolume, work: Callable[[], Result]) -> Result:
    """Return what some work returns, all launches that it began ended."""
    device = volume.device
    device.wake()
    with intact(volume.volume.values, volume.volume.path):
        try:
            result = work()
        except BaseException:
            device.drop()
            raise
        device.finish()
    return result


def _require_surface(surface: Surface) -> None:
    """Raise CallError unless it is a surface."""
    if not isinstance(surface, Surface):
        raise CallError(
            f"a {type(surface).__name__} was found; expected the Surface that extract_surface returns,"
            " which knows the grid; connect a mesh alone by connect(mesh)"
        )
