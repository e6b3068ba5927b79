"""Settle the distances of a folder's slices by their own metadata, a scanner's text, or `--spacing`."""

from collections.abc import Mapping
from dataclasses import replace

from dmc_cli.notices import Notice
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.layout import Triple
from dmc_cli.volume_io.scanner_log import ScannerLog
from dmc_cli.volume_io.told_lengths import SAME_LENGTH, Lengths, ToldLengths, differ, settled_spacing

_SAME_AS_LOG = 0.01
"""Relative difference of slices and a text that rounds, at most."""


def stack_spacing(
    slices: Mapping[ToldLengths, str],
    log: ScannerLog | None,
    step: int,
    name: str,
    settings: ReadSettings,
    title: str,
) -> tuple[Triple, list[Notice]]:
    """Return the distances in millimetres, and what is told of them.

    Those of the slices' own metadata count before a text, but for a resolution; the text's where they agree.

    Args:
        slices: What they tell, each once, and the name of the first file that does.
        log: What the scanner's text tells, if there is one.
        step: From one number of the slices' names to the next.
        name: The input, for messages.
        settings: Their spacing.
        title: What messages call the slices, such as `TIFF`.

    Raises:
        DamagedVolumeError: Lengths that are none.
        UnsupportedFormatError: An axis of space is measured in units of time.
    """
    told, notices = _agreed(slices, name)
    notices = [] if settings.spacing is not None else notices
    notices += log.notices if log is not None else []
    if log is None or log.spacing is None:
        spacing, warnings = settled_spacing(told, name, settings, f"the {title}")
        return spacing, [*notices, *warnings]
    x, y, z = log.spacing
    own: Lengths = (None, None, None) if told is None else told.known_in_mm(name)
    if not log.is_whole:
        z *= max(step, log.step)
        z = own[2] or z
    sizes = _joined((x, y, z))
    if settings.spacing is not None:
        sentence = f"{log.file.name} tells distances of {sizes} mm; those of --spacing are taken"
        return settings.spacing, [Notice("W-OPTION-PREFERRED", sentence)]
    if told is not None and differ(own, (x, y, z), _SAME_AS_LOG):
        which = "those of the text" if told.is_resolution else "those of the slices"
        sentence = (
            f"{log.file.name} tells distances of {sizes} mm of the nodes, the slices of {_joined(own)} mm; "
            f"{which} are taken; --spacing tells better"
        )
        contradiction = Notice("W-GEOMETRY-CONTRADICTED", sentence)
        if not told.is_resolution:
            spacing, warnings = settled_spacing(told, name, settings, f"the {title}")
            return spacing, [contradiction, *notices, *warnings]
        notices = [contradiction, *notices]
    sentence = f"{log.file.name} tells distances of {sizes} mm of the nodes, which are taken"
    return (x, y, z), [Notice("W-SPACING-FROM-LOG", sentence), *notices]


def _joined(lengths: Lengths) -> str:
    return " x ".join("?" if length is None else f"{length:g}" for length in lengths)


def _agreed(slices: Mapping[ToldLengths, str], name: str) -> tuple[ToldLengths | None, list[Notice]]:
    """Return what all slices tell of their distances, or none of it and a notice where they contradict."""
    if not slices:
        return None, []
    (lengths, file), *others = [(told.known_in_mm(name), file) for told, file in slices.items()]
    for other, other_file in others:
        if differ(other, lengths, SAME_LENGTH):
            sentence = (
                f"{file} tells distances of {_joined(lengths)} mm, {other_file} of {_joined(other)} mm; "
                "neither are taken; --spacing gives them"
            )
            return None, [Notice("W-GEOMETRY-CONTRADICTED", sentence)]
    most = max(slices, key=lambda told: sum(length is not None for length in told.lengths))
    return replace(most, doubts=tuple(dict.fromkeys(n for told in slices for n in told.doubts))), []
