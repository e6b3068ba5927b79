"""Help text with the options in sections, because convert has some forty of them."""

from typing import Any

import click


class SectionedOption(click.Option):
    """An option that knows the heading it stands under in the help text."""

    def __init__(self, *args: Any, section: str = "General", **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.section = section


class SectionedCommand(click.Command):
    """A command whose help lists its options section by section, in the order of declaration."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write one definition list a section."""
        sections: dict[str, list[tuple[str, str]]] = {}
        for parameter in self.get_params(ctx):
            record = None if isinstance(parameter, click.Argument) else parameter.get_help_record(ctx)
            if record is not None:
                sections.setdefault(getattr(parameter, "section", "General"), []).append(record)
        general = sections.pop("General", [])
        for heading, records in (*sections.items(), ("General", general)):
            if records:
                with formatter.section(heading):
                    formatter.write_dl(records)
