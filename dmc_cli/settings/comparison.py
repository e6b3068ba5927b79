"""Say which methods to compare."""

from dataclasses import dataclass, field
from typing import Any

from dmc_cli.errors import SettingsError
from dmc_cli.methods import METHODS, method_named
from dmc_cli.settings.checks import check_path, check_run
from dmc_cli.settings.choices import SIMPLIFIED, Border, Inside
from dmc_cli.settings.reading import ReadSettings
from dmc_cli.settings.surface import SurfaceSettings, check_isovalue
from dmc_cli.settings.types import settle_types


@dataclass(frozen=True, kw_only=True)
class CompareSettings:
    """Which methods to compare on the surface of a volume; `isovalue` as in `SurfaceSettings`.

    A method is its name, behind a colon a value of one of its options, and `+simplify` for its quads without
    the papers' patterns: `dc:particle`, `dmc+simplify`. Without any, all methods with their defaults are
    compared, and the simplified mesh of the first. `repeats` is how often each surface is extracted; the
    least time counts.
    """

    input: str
    isovalue: float | str | None = None
    methods: tuple[str, ...] = ()
    inside: Inside = "above"
    border: Border = "open"
    read: ReadSettings = field(default_factory=ReadSettings)
    repeats: int = 3
    device: str = "auto"
    threads: int | None = None

    def __post_init__(self) -> None:
        """Check every type and range once, at the door."""
        settle_types(self)
        check_path("input", self.input)
        check_run(self.device, self.threads)
        check_isovalue(self.isovalue)
        if not self.methods:
            object.__setattr__(self, "methods", (*METHODS, f"{next(iter(METHODS))}{SIMPLIFIED}"))
        if len(set(self.methods)) < len(self.methods):
            raise SettingsError(f"methods are {', '.join(self.methods)}; expected each once")
        if self.repeats < 1:
            raise SettingsError(f"repeats is {self.repeats}; expected 1 or more")
        for method in self.methods:
            self.surface_of(method)

    def surface_of(self, method: str) -> SurfaceSettings:
        """Return the settings of a method's surface, `method` as in `methods`.

        Raises:
            SettingsError: There is no such method, or none of its options has that value.
        """
        name, _, value = method.removesuffix(SIMPLIFIED).partition(":")
        taken = method_named(name).options
        chosen: dict[str, Any] = {}
        if value:
            known = {each: option for option, values in taken.items() for each in values}
            if value not in known:
                raise SettingsError(
                    f"{value!r:.80} is no value of an option of the method {name}; expected one of"
                    f" {', '.join(sorted(known)) or 'none'}"
                )
            chosen[known[value]] = value
        if method.endswith(SIMPLIFIED) and method_named(name).faces != "quads":
            raise SettingsError(f"{method:.80} is none: simplification needs quads; leave {SIMPLIFIED} out")
        if "border" in taken:
            chosen["border"] = self.border
        return SurfaceSettings(isovalue=self.isovalue, method=name, inside=self.inside, **chosen)
