"""Say why a volume has no surface at an isovalue, and which isovalues there are."""

from dmc_cli.errors import DmcError, EmptySurfaceError, VolumeError
from dmc_cli.volume import Volume


def no_surface(volume: Volume, isovalue: float, *, otherwise: str = "") -> DmcError:
    """Return the error that names the range of the values, to choose from.

    Args:
        volume: A volume of which no face was made.
        isovalue: The isovalue, in physical values.
        otherwise: What else may be done than choosing another isovalue, if anything.
    """
    ends = volume.value_range()
    if ends is None:
        return VolumeError(
            f"{volume.path} holds no value that is data: all are NaN, infinite or padding; expected a volume"
            " with finite values"
        )
    if ends[0] == ends[1]:
        found = f"every value is {ends[0]:g}"
        advice = "a constant volume has no surface; check that the right file was read"
    else:
        found = f"the values run from {ends[0]:g} to {ends[1]:g}"
        advice = f"choose an isovalue inside that range with -i{otherwise}"
    return EmptySurfaceError(f"there is no surface at isovalue {isovalue:g}: {found}; {advice}")
