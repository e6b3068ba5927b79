"""Tell slices of one volume whose values do not mean the same."""

from dmc_cli.notices import Notice
from dmc_cli.volume_io.dicom import elements
from dmc_cli.volume_io.dicom.frames import Frame


def mixed_told(frames: list[Frame]) -> list[Notice]:
    """Return a warning where some slices tell a rescale and others, which then are stored values, none."""
    singles = [frame for frame in frames if frame.pixels.frames == 1 and frame.lookup is None]
    without = [frame for frame in singles if not _tells_scale(frame)]
    others = {(frame.slope, frame.intercept) for frame in singles if frame not in without}
    if not without or others <= {(1.0, 0.0)}:
        return []
    sentence = (
        f"no RescaleSlope and RescaleIntercept found in {len(without)} of {len(frames)} slices, first "
        f"{without[0].name}, that others have; the values of these slices are the stored ones"
    )
    return [Notice("W-RESCALE-UNKNOWN", sentence)]


def _tells_scale(frame: Frame) -> bool:
    dataset = frame.header.dataset
    return any(elements.numbers(dataset, tag, 1) for tag in (0x00281052, 0x00281053, 0x3004000E))
