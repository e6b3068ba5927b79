"""Hold settings against their annotations, in one place.

NumPy's scalars and sequences become Python's own; what no annotation means is refused, a truth value for a
number among it.
"""

from collections.abc import Callable
from dataclasses import fields
from numbers import Integral, Real
from types import NoneType, UnionType
from typing import Any, Literal, get_args, get_origin

from dmc_cli.errors import SettingsError


def as_real(value: object) -> float:
    """Return a real number as Python's float; TypeError or OverflowError for anything else."""
    if not isinstance(value, Real) or isinstance(value, bool):
        raise TypeError("a number")
    return float(value)


def is_whole(value: object) -> bool:
    """Return whether a value is a whole number, Python's or NumPy's, and no truth value."""
    return isinstance(value, Integral) and not isinstance(value, bool)


def _as_whole(value: Any) -> int:
    if not is_whole(value):
        raise TypeError("a whole number")
    return int(value)


def _as_truth(value: object) -> bool:
    if not isinstance(value, bool):
        raise TypeError("True or False")
    return value


def _as_text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError("a text")
    return str.__str__(value)


_PLAIN: dict[Any, Callable[[object], Any]] = {
    float: as_real,
    int: _as_whole,
    bool: _as_truth,
    str: _as_text,
}


def _converted(value: object, annotation: Any) -> Any:
    """Return a value as its annotation has it; else TypeError with what that expects."""
    value = value.tolist() if hasattr(value, "tolist") else value  # NumPy's to Python's, which needs no NumPy
    if annotation in _PLAIN:
        return _PLAIN[annotation](value)
    parts = get_args(annotation)
    if isinstance(annotation, UnionType) or NoneType in parts:
        return None if value is None else _as_one_of(value, [p for p in parts if p is not NoneType])
    if get_origin(annotation) is Literal:
        if not isinstance(value, str) or value not in parts:
            raise TypeError(f"one of {', '.join(parts)}")
        return value
    if get_origin(annotation) is tuple:
        return _as_tuple(value, parts)
    if not isinstance(value, annotation):
        raise TypeError(f"{annotation.__name__}")
    return value


def _as_one_of(value: object, parts: list[Any]) -> Any:
    """Return a value as a text where one is given and taken, else as the first of the parts has it."""
    if isinstance(value, str) and str in parts:
        return _as_text(value)
    return _converted(value, parts[0])


def _as_tuple(value: object, parts: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return a sequence as a tuple of the parts' types."""
    is_any_length = parts[-1] is Ellipsis
    if not isinstance(value, tuple | list):
        raise TypeError("a tuple")
    if not is_any_length and len(value) != len(parts):
        raise TypeError(f"{len(parts)} values")
    return tuple(_converted(item, parts[0]) for item in value)


def settle_types(settings: Any) -> None:
    """Make each value of a settings' dataclass what its annotation says.

    Raises:
        SettingsError: It cannot be that.
    """
    for field in fields(settings):
        given = getattr(settings, field.name)
        try:
            value = _converted(given, field.type)
        except TypeError as error:
            raise SettingsError(f"{field.name} is {given!r:.80}; expected {error}") from error
        except OverflowError as error:
            raise SettingsError(f"{field.name} is beyond every float; expected a finite number") from error
        if value is not given:
            object.__setattr__(settings, field.name, value)
