"""Define what `--require` may ask of a mesh: words, sets of words, and comparisons of figures with numbers.

A comparison is `NAME>=NUMBER`, its name a key of the report with the sections that it stands in. Without them
it is of `mesh`, `topology` or `quality`, or of another section where only one figure is called so:
`quality.shape_min` is `shape_min`. Times and memory are no figures: they are known only when everything is
written.
"""

import math
import operator
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from dmc_cli.errors import SettingsError

WORDS: dict[str, tuple[str, ...]] = {
    "manifold": (
        "topology.non_manifold_vertices",
        "topology.non_manifold_edges",
        "topology.misoriented_edges",
    ),
    "closed": ("topology.boundary_edges",),
    "all-quads": ("mesh.triangles",),
    "on-surface": ("deviation.max_relative",),
    "no-self-intersections": ("quality.self_intersections",),
}
"""What is asked by one word, and the figures that it looks at."""

SETS: dict[str, tuple[str, ...]] = {
    "fe": (
        *("min_angle>=25", "max_angle<=155", "aspect_ratio_max<=5", "warpage_max<=30"),
        *("scaled_jacobian_min>=0.3", "triangle_aspect_ratio_max<=5", "triangle_scaled_jacobian_min>=0.3"),
    ),
    "print": ("closed", "manifold", "no-self-intersections", "components<=1"),
}
"""What is asked by the name of what the mesh is for.

`fe`: what pre-processors of finite elements warn of: corners (Autodesk Nastran under 25 degrees; 155 is 180
less that), an aspect ratio above 5 (HyperMesh), a warp above 30 degrees (OptiStruct); and a scaled Jacobian
of 0.3 at least, which is usual. Limits of quads count only where there are some, those of triangles, too.
`print`: what a slicer takes without repair. Another number of components takes the place of the set's where
one is required beside it, and where walls were measured against a length, none may be thinner.
"""

NAMES = (*WORDS, *SETS)
"""Everything that is asked by a name."""

_OF_THE_MESH_ITSELF = ("mesh", "topology", "quality")
"""Sections whose figures need not name them, whatever figures of others are called."""

_SPREAD = ("mean", "rms", "min", "percentile_5", "percentile_95", "max")
_WAY = ("samples", "mean", "rms", "percentile_95", "max")

_OF_A_MESH: dict[str, tuple[str, ...]] = {
    "mesh": ("vertices", "quads", "triangles", "area", "volume"),
    "topology": (
        *("components", "euler_characteristic", "genus", "boundary_edges", "boundary_loops"),
        *("non_manifold_edges", "non_manifold_vertices", "misoriented_edges", "unused_vertices"),
        "irregular_percent",
    ),
    "quality": (
        *("shape_mean", "shape_min", "scaled_jacobian_min", "warpage_max", "mean_ratio_mean"),
        *("min_angle", "max_angle", "scaled_jacobian_mean", "aspect_ratio_mean", "aspect_ratio_max"),
        *("skew_mean", "skew_max", "taper_mean", "taper_max", "stretch_mean", "stretch_min"),
        *("warpage_mean", "mean_ratio_min", "radius_ratio_mean", "radius_ratio_min"),
        *("triangle_scaled_jacobian_mean", "triangle_scaled_jacobian_min"),
        *("triangle_aspect_ratio_mean", "triangle_aspect_ratio_max", "self_intersections"),
    ),
    "deviation": (
        *("mean", "rms", "max", "max_relative", "mean_mm", "max_mm", "rounding_mm", "rounding_relative"),
    ),
}
_OF_ITS_CURVATURE: dict[str, tuple[str, ...]] = {
    "curvature": ("vertices", "total_gaussian"),
    "curvature.mean": _SPREAD,
    "curvature.gaussian": _SPREAD,
}
_OF_CHANGES: dict[str, tuple[str, ...]] = {
    "simplification": (
        *("removed_3x3y", "removed_3333", "refused", "irregular_percent_before"),
        *("irregular_percent_after", "irregular_percent_patterns", "rounds", "operations"),
    ),
    "repair": ("pairs_before", "pairs_after", "moved", "left_surface", "rounds"),
    "size": (
        *("quads_wanted", "edge_length_wanted", "max_error", "quads_before", "quads", "edge_length"),
        *("fixed_quads", "rounds", "taken_back"),
    ),
    "size.to_before": ("samples", "mean", "rms", "max"),
    "size.from_before": ("samples", "mean", "rms", "max"),
}
_OF_ITS_MAKING: dict[str, tuple[str, ...]] = {
    "input": ("no_data_nodes",),
    "part.dropped": ("components", "nodes", "volume"),
    "part.filled": ("components", "nodes", "volume"),
    "surface": (
        *("isovalue", "stored_isovalue", "polygons", "unused_vertices", "crossed_edges", "active_cells"),
        *("multi_polygon_cells", "ambiguous_faces", "flipped_faces", "fallback_vertices", "tunnel_cells"),
    ),
}
_OF_A_FILE: dict[str, tuple[str, ...]] = {"mesh": ("faces",)}
_OF_ITS_WALLS: dict[str, tuple[str, ...]] = {
    "thickness": ("vertices", "min", "percentile_5", "median", "max", "percent_below"),
}
_OF_MEASURING: dict[str, tuple[str, ...]] = {
    "distance": ("density",),
    "distance.to_other": _WAY,
    "distance.from_other": _WAY,
    "distance.both": _WAY,
}


def _names(*tables: Mapping[str, tuple[str, ...]]) -> tuple[str, ...]:
    """Return the whole names of figures by their sections."""
    return tuple(f"{section}.{key}" for table in tables for section, keys in table.items() for key in keys)


CONVERT_FIGURES = _names(_OF_A_MESH, _OF_ITS_CURVATURE, _OF_ITS_WALLS, _OF_ITS_MAKING, _OF_CHANGES)
"""Whole names of the figures in the report of `dmc convert`."""

MEASURE_FIGURES = _names(_OF_A_MESH, _OF_ITS_CURVATURE, _OF_ITS_WALLS, _OF_A_FILE, _OF_MEASURING)
"""Whole names of the figures in the report of `dmc measure`."""

MESH_FIGURES = _names(_OF_A_MESH, _OF_ITS_WALLS, _OF_A_FILE, _OF_CHANGES)
"""Whole names of the figures in the report of `dmc mesh`."""

_RELATIONS: dict[str, tuple[Callable[..., Any], str]] = {
    ">=": (operator.ge, "at least"),
    "<=": (operator.le, "at most"),
    "==": (operator.eq, "exactly"),
    "!=": (operator.ne, "anything but"),
    "=": (operator.eq, "exactly"),
    ">": (operator.gt, "more than"),
    "<": (operator.lt, "less than"),
}
"""How a figure may compare with a number, and how that is told."""

_COMPARISON = re.compile(rf"([^<>=!]*?)\s*({'|'.join(_RELATIONS)})\s*([^<>=!]*)")

_NEAR_NAMES = 4
"""Names that a message proposes, at most."""


@dataclass(frozen=True)
class Comparison:
    """What a figure of the report has to be.

    Attributes:
        figure: Its whole name, `section.key`.
        relation: One of `>=`, `<=`, `>`, `<`, `==`, `=`, `!=`.
        limit: The number beside it.
    """

    figure: str
    relation: str
    limit: float

    @property
    def compare(self) -> Callable[..., Any]:
        """Return the function of a figure, or of an array of them, and the limit that tells what is so."""
        return _RELATIONS[self.relation][0]

    def holds(self, found: float | None) -> bool:
        """Return whether a figure is so; one that has no value is not."""
        return found is not None and bool(self.compare(found, self.limit))

    @property
    def expected(self) -> str:
        """Return what is expected, in words."""
        return f"{_RELATIONS[self.relation][1]} {self.limit:.12g}"


def parse_requirement(text: str, figures: Iterable[str]) -> str | Comparison:
    """Return the name, of a word or a set, or the comparison that a text is.

    Args:
        text: What is required.
        figures: Whole names of the figures that there are.

    Raises:
        SettingsError: It is neither; the message names words or figures that are near.
    """
    if text in NAMES:
        return text
    found = _COMPARISON.fullmatch(text)
    if found is None:
        raise SettingsError(
            f"require is {text!r:.80}; expected one of {', '.join(NAMES)}, or a figure of the report beside a"
            " number, as in shape_min>=0.3"
        )
    name, relation, number = found.groups()
    figure = _whole_name(name, tuple(figures))
    try:
        limit = float(number)
    except ValueError:
        limit = math.nan
    if not math.isfinite(limit):
        raise SettingsError(
            f"require is {text!r:.80}, where {number!r:.40} is no number; expected one, as in shape_min>=0.3"
        )
    return Comparison(figure, relation, limit)


def settled_requirements(texts: Iterable[str], figures: Iterable[str]) -> tuple[str, ...]:
    """Return what is required, each once, without spaces round it.

    Raises:
        SettingsError: One is neither a word nor a comparison.
    """
    settled = tuple(dict.fromkeys(text.strip() for text in texts))
    for text in settled:
        parse_requirement(text, figures)
    return settled


def looks_at(names: str, texts: Iterable[str], figures: Iterable[str]) -> bool:
    """Return whether a requirement looks at a figure whose whole name begins with `names`."""
    parts = [part for text in texts for part in SETS.get(text, (text,))]
    asked = [parse_requirement(part, figures) for part in parts]
    looked_at = [(one.figure,) if isinstance(one, Comparison) else WORDS[one] for one in asked]
    return any(figure.startswith(names) for part in looked_at for figure in part)


def _whole_name(name: str, figures: tuple[str, ...]) -> str:
    """Return the one figure that a name means.

    Raises:
        SettingsError: None is called so, or several are.
    """
    for section in ("", *(f"{section}." for section in _OF_THE_MESH_ITSELF)):
        if section + name in figures:
            return section + name
    named = [figure for figure in figures if figure.endswith(f".{name}")]
    if len(named) == 1:
        return named[0]
    if named:
        raise SettingsError(
            f"require names {name!r:.80}, as {len(named)} figures of the report are called; expected one of"
            f" {', '.join(named)}"
        )
    raise SettingsError(
        f"require names {name!r:.80}, as no figure of the report is called; expected one such as"
        f" {', '.join(_near_names(name, figures))}; docs/report-schema.json has them all"
    )


def _near_names(name: str, figures: tuple[str, ...]) -> list[str]:
    """Return the names of figures that are written most alike."""
    from difflib import get_close_matches

    keys = [figure.rpartition(".")[2] for figure in figures]
    short = {key if keys.count(key) == 1 else figure: None for key, figure in zip(keys, figures, strict=True)}
    return get_close_matches(name, list(short), _NEAR_NAMES, cutoff=0.0)
