"""Tell the options of reading that were given but have no effect on a format."""

from collections.abc import Iterator
from dataclasses import fields

from dmc_cli.notices import Notice
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_formats import formats_with
from dmc_cli.volume_io.layout import without_effect


def unused_options(format_name: str, settings: ReadSettings) -> Iterator[Notice]:
    """Yield a warning for each option that was given and that a format's reader never looks at."""
    default = ReadSettings()
    for option in (field.name for field in fields(ReadSettings)):
        takers = formats_with(option)  # none of an option that is for all formats, or for synthetic fields
        is_used = not takers or format_name in takers
        if is_used or getattr(settings, option) == getattr(default, option):
            continue
        if option in ("spacing", "origin"):
            what = "field" if format_name == "synthetic" else "file"
            yield from without_effect(option, settings, f"the {what}")
        else:
            flag = f"--{option.replace('_', '-')}"
            told = f"{flag} has no effect on {format_name} input; it is for {', '.join(takers)}"
            yield Notice("W-OPTION-UNUSED", told)
