"""List options in sections of the help text, because convert has some forty of them; each is given once."""

from collections import Counter
from typing import Any

import click

from dmc_cli.cli.group import HELP_NAMES


class SectionedOption(click.Option):
    """An option that knows the heading it stands under in the help text, and how often it may be given.

    Of flags, and where `again` is None, the last one counts, as shells' aliases have it. Any other option
    decides what is made: a second one is refused, and `again` is the advice.
    """

    def __init__(
        self,
        *args: Any,
        section: str = "General",
        again: str | None = "keep one of them",
        **kwargs: Any,
    ) -> None:
        super().__init__(*args, **kwargs)
        self.section = section
        self.again = None if self.multiple or self.count or self.is_flag else again

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """Return names and help text; a default that is shown though it is none looks like any other."""
        record = super().get_help_record(ctx)
        if record is None or not isinstance(self.show_default, str):
            return record
        names, text = record
        return names, text.replace(f"[default: ({self.show_default})]", f"[default: {self.show_default}]")


class SectionedCommand(click.Command):
    """A command whose help lists its options section by section, in the order of declaration."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse as click does, after options that were given too often are refused."""
        if not ctx.resilient_parsing:
            _, _, given = self.make_parser(ctx).parse_args(args=list(args))
            if not any(parameter.is_eager for parameter in given):  # as --help is
                _refuse_repeated(given, ctx)
        return super().parse_args(ctx, args)

    def get_help_option_names(self, ctx: click.Context) -> list[str]:
        """Return the names of the help option; click makes it once, by whatever context comes first."""
        return list(HELP_NAMES)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options, one definition list a section."""
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


def _refuse_repeated(given: list[click.Parameter], ctx: click.Context) -> None:
    """Raise if one of the parameters, as they were given, is an option that was given too often."""
    for parameter, count in Counter(given).items():
        again = getattr(parameter, "again", None)
        if count > 1 and again is not None:
            hint = parameter.get_error_hint(ctx)
            raise click.UsageError(f"{hint} was given {count} times; expected once; {again}", ctx)
