"""Keep what a property returns, without a lock.

`functools.cached_property` of Python up to 3.11 holds a lock while it evaluates: one for each property of a
class, not of an object. A process that was forked while another thread held it waits for it for ever.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar, overload

Value = TypeVar("Value")


class kept_property(Generic[Value]):  # noqa: N801 - read as a decorator, beside `property`
    """A property that is evaluated when it is first asked for; the object keeps the value.

    Threads that ask at the same time may each evaluate it, and all get the value that was kept first: it is
    for what does no harm when it is done twice. The value lies in the object's `__dict__` under the
    property's name, where later look-ups find it before they come here.
    """

    def __init__(self, evaluate: Callable[[Any], Value]) -> None:
        self._evaluate = evaluate
        self.__doc__ = evaluate.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, instance: None, owner: type) -> kept_property[Value]: ...

    @overload
    def __get__(self, instance: object, owner: type) -> Value: ...

    def __get__(self, instance: object | None, owner: type) -> kept_property[Value] | Value:
        if instance is None:
            return self
        kept: dict[str, Value] = instance.__dict__
        return kept.setdefault(self._name, self._evaluate(instance))
