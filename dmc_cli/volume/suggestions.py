"""Tell what kind of volume there is, and which isovalues suit it.

Nothing is guessed of what values mean: Hounsfield units are those that a file states. What has two different
values is a mask, whole numbers of few values in pieces are labels, and of all else the histogram decides.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dmc_cli.errors import SettingsError
from dmc_cli.isovalue_choices import PRESETS, Choice, parse_choice
from dmc_cli.kept_property import kept_property
from dmc_cli.volume.histogram import Histogram, count_values
from dmc_cli.volume.label_guess import looks_like_labels
from dmc_cli.volume.otsu import otsu_cuts
from dmc_cli.volume.volume import Volume

HOUNSFIELD = "HU"

DEFAULT_PRESET = "bone"
"""What is meant of a CT in Hounsfield units where nothing is said."""


@dataclass(frozen=True)
class Suggestion:
    """An isovalue with the words that choose it: `otsu`, `bone`, `50%`."""

    choice: str
    isovalue: float


@dataclass(frozen=True)
class Chosen:
    """A number that a choice means for a volume.

    Attributes:
        isovalue: The number, in physical values; of a band its lower end.
        choice: The words that choose it: those that were given, or what the default came to.
        reason: Why, of a default; else empty.
        band: The ends of a band, or None.
    """

    isovalue: float
    choice: str
    reason: str = ""
    band: tuple[float, float] | None = None


class Suggestions:
    """What a volume is, and the isovalues that its values suggest; its values are counted once, if at all."""

    def __init__(self, volume: Volume) -> None:
        self.volume = volume

    @kept_property
    def histogram(self) -> Histogram:
        """Return how many nodes have which value."""
        return count_values(self.volume)

    @kept_property
    def ends(self) -> tuple[float, float] | None:
        """Return the least and the greatest value, None where no node has data."""
        return self.volume.value_range()

    @kept_property
    def kind(self) -> str:
        """Return what the volume is: a mask, CT in HU, MR or another modality, a label map, a field."""
        if self.is_mask:
            return "mask"
        if self.volume.modality:
            unit = self.volume.value_unit
            return f"{self.volume.modality} in {unit}" if unit else self.volume.modality
        return "label map" if looks_like_labels(self.volume) else "field"

    @kept_property
    def is_mask(self) -> bool:
        """Return whether there are two different values."""
        if self.ends is None or len(self.histogram.values) != 2:
            return False
        if self.histogram.is_exact:
            return True
        low, high = ((end - self.volume.intercept) / self.volume.slope for end in self.ends)
        planes = self.volume.values  # bins with two values may hold more
        return all(bool(np.isin(plane[np.isfinite(plane)], (low, high)).all()) for plane in planes)

    @kept_property
    def tissue(self) -> float:
        """Return the isovalue that parts a body from air: the skin's in HU, else Otsu's."""
        if self.volume.value_unit == HOUNSFIELD:
            return PRESETS["skin"]
        return self.choose("otsu").isovalue

    def suggested(self, *, counts: bool = True) -> Iterator[Suggestion]:
        """Yield isovalues that suit the volume, the one without `-i` first, each number once.

        Without `counts` those for which values would have to be counted, if they are not yet, are left out.
        """
        told: set[float] = set()
        for choice in self._words(counts=counts or "histogram" in self.__dict__):
            found = self.choose(choice)
            if found.isovalue not in told:
                told.add(found.isovalue)
                yield Suggestion(found.choice, found.isovalue)

    def _words(self, *, counts: bool) -> Iterator[str | None]:
        """Yield choices that can be made here."""
        if self.ends is None or self.ends[0] == self.ends[1]:
            return
        yield None
        if self.volume.value_unit == HOUNSFIELD:
            yield from (name for name, level in PRESETS.items() if self._holds(level))
        if not counts or self.is_mask:
            return
        yield "otsu"
        if len(self.histogram.values) > 2:
            yield from ("otsu:2:1", "otsu:2")

    def choose(self, text: str | None) -> Chosen:
        """Return the number that a choice means; of a volume without a surface its value.

        Raises:
            SettingsError: It means none of these values: a preset where they are not told to be in HU, more
                classes than there are values.
        """
        choice = parse_choice(text)
        if choice.rule == "band":
            low, high = choice.numbers
            return Chosen(low, choice.name, band=(low, high))
        if choice.rule == "preset":
            return Chosen(self._preset(choice.name), choice.name)
        if self.ends is None or self.ends[0] == self.ends[1]:
            return Chosen(self.ends[0] if self.ends else 0.0, choice.name)
        low, high = self.ends
        if choice.rule == "percent":
            share = choice.numbers[0] / 100
            return Chosen(low * (1 - share) + high * share, choice.name)
        return self._default() if choice.rule == "default" else Chosen(self._otsu(choice), choice.name)

    def _default(self) -> Chosen:
        """Return what is chosen where nothing is said."""
        if self.volume.value_unit == HOUNSFIELD and self._holds(PRESETS[DEFAULT_PRESET]):
            return Chosen(PRESETS[DEFAULT_PRESET], DEFAULT_PRESET, "of a CT in HU")
        if self.is_mask:
            low, high = self.ends or (0.0, 0.0)
            return Chosen(low / 2 + high / 2, "50%", "half of a mask")
        return Chosen(self._otsu(Choice("otsu")), "otsu", "by the histogram")

    def _holds(self, level: float) -> bool:
        """Return whether there are values on both sides of a level."""
        return self.ends is not None and self.ends[0] < level <= self.ends[1]

    def _preset(self, name: str) -> float:
        """Return a preset's number."""
        if self.volume.value_unit != HOUNSFIELD:
            unit = self.volume.value_unit
            found = f"in {unit}" if unit else f"of {self.volume.format or 'the volume'} without a word of HU"
            values = "no data" if self.ends is None else f"from {self.ends[0]:g} to {self.ends[1]:g}"
            raise SettingsError(
                f"isovalue is {name!r}, a preset in Hounsfield units (HU), but the values are {found},"
                f" {values}; expected a file that says HU itself, as DICOM of CT does; if they are, give the"
                f" number: -i {PRESETS[name]:g}"
            )
        return PRESETS[name]

    def _otsu(self, choice: Choice) -> float:
        """Return an isovalue by Otsu's method."""
        histogram = self.histogram
        if len(histogram.values) <= choice.count:
            raise SettingsError(
                f"isovalue is {choice.name!r}, but {self.volume.path or 'the volume'} has only"
                f" {len(histogram.values)} different values; expected more than {choice.count}; choose fewer"
                " classes, or a number"
            )
        return otsu_cuts(histogram.values, histogram.counts, choice.count)[choice.rank - 1]
