"""Make an option from the settings field that it fills, and settings from the options of the same names."""

from collections.abc import Callable
from dataclasses import MISSING, Field, fields
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

import click

from dmc_cli.cli.sections import SectionedOption

Decorator = Callable[[Any], Any]
Settings = TypeVar("Settings")


def setting(owner: type, name: str, *flags: str, section: str, help: str, **extra: Any) -> Decorator:
    """Make the option that fills the field `name` of the settings class `owner`.

    Args:
        owner: A dataclass of `settings/`.
        name: Its field; the flag is the same with dashes unless `flags` are given.
        flags: Other flags for the same field.
        section: The heading in the help text.
        help: What the option does.
        extra: Further arguments of click, for example the type where the field's is no choice.
    """
    if "type" not in extra and "is_flag" not in extra:
        choices = _choices(get_type_hints(owner)[name])
        extra["type"] = click.Choice(choices) if choices else None
    default = default_of(owner, name)
    if default == ():
        extra["show_default"] = False
    names = flags or (f"--{name.replace('_', '-')}",)
    return click.option(
        *names, name, cls=SectionedOption, section=section, default=default, help=help, **extra
    )


def default_of(owner: type, name: str) -> Any:
    """Return the default of a settings field, None where it has none."""
    found: Field[Any] = next(field for field in fields(owner) if field.name == name)
    return None if found.default is MISSING else found.default


def gather(owner: type[Settings], values: dict[str, Any], **given: Any) -> Settings:
    """Build settings from the options of the same names; `given` fills the other fields."""
    names = {field.name for field in fields(owner) if field.init}  # type: ignore[arg-type]
    return owner(**{name: value for name, value in values.items() if name in names} | given)


def stack(*decorators: Decorator) -> Decorator:
    """Join options into one decorator that lists them in this order."""

    def apply(command: Any) -> Any:
        for decorator in reversed(decorators):
            command = decorator(command)
        return command

    return apply


def _choices(annotation: Any) -> tuple[str, ...]:
    """Return the values of a Literal, or of the Literal in an optional one; none for other types."""
    for part in (annotation, *get_args(annotation)):
        if get_origin(part) is Literal:
            return get_args(part)
    return ()
