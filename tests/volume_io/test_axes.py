"""Axes that count volumes: how they are told and chosen, however many there are."""

from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.axes import MOST_LISTED, Axis, chosen_volume, flat_index, listed_volumes, stacked_image


def test_of_more_volumes_than_memory_holds_the_first_are_listed():
    """A header may promise them; the file is compared with it later."""
    image = stacked_image((4, 3, 2), Axis("time", 1 << 40), Axis("channel", 2))
    listed = listed_volumes([image], ReadSettings(), "a")
    assert len(listed) == MOST_LISTED
    assert listed[3] == "time 1, channel 1, 4 x 3 x 2"
    settings = ReadSettings(time=str((1 << 39) + 1), channel="1")
    assert flat_index(image, chosen_volume([image], settings, "a")) == (1 << 40) + 3
