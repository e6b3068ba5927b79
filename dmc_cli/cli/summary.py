"""Summarise reports and descriptions in a few readable lines."""

from collections.abc import Iterator, Sequence
from typing import Any

from dmc_cli.cli.histogram import histogram_lines
from dmc_cli.cli.terminal import echo_lines
from dmc_cli.printable import short_number

_MOST_VOLUMES = 100
"""Volumes of a file that are shown, at most."""

_MOST_COMPONENTS = 20
"""Components that are shown, at most."""
_MOST_LABELS = 40
"""Labels that have a line of the summary, at most."""

_BAR = 24
"""Characters of the longest bar in a table."""

_SLOW_STAGES = (
    "compile",
    "read",
    "prepare",
    "surface",
    "smooth",
    "repair",
    "shells",
    "normals",
    "halfedges",
    "simplify",
    "remesh",
    "size",
    "relax",
    "report",
    "write",
)
"""Stages that the last line names, in the order of the run."""


_WORST = (("aspect ratio", "aspect_ratio"), ("skew", "skew"), ("taper", "taper"))
"""Measures of quads whose largest value is the worst, and their keys."""


def echo_summaries(reports: Sequence[dict[str, Any]]) -> None:
    """Print what conversions of one input did to standard error; warnings and the volume stand there once."""
    told: set[str] = set()
    for report in reports:
        lines = [line for line in summary_lines(report) if line not in told]
        told.update(line for line in lines if line.startswith(("warning: ", "volume ")))
        echo_lines(lines, err=True)


def summary_lines(report: dict[str, Any]) -> Iterator[str]:
    """Yield the lines of the summary; what the report does not hold is left out."""
    yield from (f"warning: {warning}" for warning in _warnings(report))
    yield f"volume    {volume_line(report['input'])}"
    yield from _part_lines(report.get("part"))
    yield f"surface   {_surface_line(report['surface'])}"
    yield from _choice_lines(report["surface"].get("choice"))
    yield f"mesh      {_mesh_line(report['mesh'])}, {_output_space(report)}"
    yield from _repair_lines(report)
    if size := report.get("size"):
        yield f"size      {_size_line(size)}"
    if topology := report.get("topology"):
        yield f"topology  {_topology_line(topology)}"
    quality = report.get("quality")
    if quality and quality["self_intersections"] is not None:
        yield f"faces     {_intersections(quality)}"
    if deviation := report.get("deviation"):
        yield (
            f"deviation at most {_number(deviation['max_relative'])} of the value range,"
            f" {_number(deviation['max_mm'])} mm; rounding at most {_number(deviation['rounding_mm'])} mm"
        )
    yield from _requirement_lines(report)
    if timings := report.get("timings_ms"):
        yield f"time      {_time_line(timings)}"


def _repair_lines(report: dict[str, Any]) -> Iterator[str]:
    """Tell what became of faces that intersected, if there were any."""
    repair = report.get("repair")
    if repair and repair["pairs_before"]:
        left = f", {repair['left_surface']} of them off the surface" if repair["left_surface"] else ""
        yield (
            f"repair    {repair['pairs_before']} pair(s) of faces intersected, {repair['pairs_after']} do"
            f" now; {repair['moved']} vertices moved{left}"
        )


def rework_lines(report: dict[str, Any]) -> Iterator[str]:
    """Yield the lines of `dmc mesh`; what the report does not hold is left out."""
    yield from (f"warning: {warning}" for warning in _warnings(report))
    read, mesh = report["input"], report["mesh"]
    yield f"read      {read['vertices']} vertices, {read['faces']} faces"
    unit = "" if mesh["unit"] == "mm" else f" in {mesh['unit']}"
    yield f"mesh      {_mesh_line(mesh)}, {_space_name(mesh['space'])}{unit}"
    if topology := report["topology"]:
        yield f"topology  {_topology_line(topology)}"
    if quality := report["quality"]:
        yield f"faces     {_intersections(quality)}"
    yield f"time      {_time_line(report['timings_ms'])}"


def label_lines(report: dict[str, Any]) -> Iterator[str]:
    """Yield the lines of the summary of a label map: a line a label."""
    yield from (f"warning: {warning}" for warning in _warnings(report))
    yield f"volume    {volume_line(report['input'])}"
    rows = report["labels"]
    yield f"mesh      {_mesh_line(report['mesh'])}, {_output_space(report)}; {len(rows)} label(s)"
    for row in rows[:_MOST_LABELS]:
        mesh, change = row["mesh"], row["mesh"]["volume_change_percent"]
        name = "" if row["name"] == f"label_{row['label']}" else f" {row['name']}"
        told = "" if change is None else f", {round(change, 3) + 0.0:+.3f} % against its nodes"
        yield (
            f"label     {row['label']}{name}: {row['nodes']} nodes, {mesh['quads']} quads, volume"
            f" {mesh['volume']:.6g}{told}"
        )
    if len(rows) > _MOST_LABELS:
        yield f"          and {len(rows) - _MOST_LABELS} more; --report has them all"
    if timings := report.get("timings_ms"):
        yield f"time      {_time_line(timings)}"


def measure_lines(report: dict[str, Any]) -> Iterator[str]:
    """Yield the lines of `dmc measure`."""
    yield from (f"warning   {warning}" for warning in _warnings(report))
    mesh, topology, quality = report["mesh"], report["topology"], report["quality"]
    yield f"mesh      {_mesh_line(mesh)}"
    yield f"topology  {_topology_line(topology)}, Euler characteristic {topology['euler_characteristic']}"
    histogram = ", ".join(f"{count} of {valence}" for valence, count in topology["valence_histogram"].items())
    yield f"valences  {histogram}; {topology['irregular_percent']:.2f} % irregular"
    yield f"shape     {_shape_line(mesh, quality)}"
    yield f"angles    {_number(quality['min_angle'], 4)} to {_number(quality['max_angle'], 4)} degrees"
    yield f"elements  {_elements_line(mesh, quality)}"
    yield f"faces     {_intersections(quality)}"
    if deviation := report["deviation"]:
        yield (
            f"deviation mean {_number(deviation['mean'])}, at most {_number(deviation['max'])} in values,"
            f" {_number(deviation['max_relative'])} of their range, {_number(deviation['max_mm'])} mm"
        )
    if curvature := report["curvature"]:
        for name, key in (("curvature mean", "mean"), ("          Gaussian", "gaussian")):
            found = curvature[key]
            yield (
                f"{name}: {_number(found['mean'], 3)} over the area, {_number(found['min'], 3)} to"
                f" {_number(found['max'], 3)}, of nine in ten vertices {_number(found['percentile_5'], 3)} to"
                f" {_number(found['percentile_95'], 3)}"
            )
    if thickness := report["thickness"]:
        yield f"thickness {_thickness_line(thickness, mesh['unit'])}"
    if distance := report["distance"]:
        for name, key in (("distance  to the other mesh", "to_other"), ("          from it", "from_other")):
            way = distance[key]
            yield (
                f"{name}: mean {_number(way['mean'], 3)}, 95 % within {_number(way['percentile_95'], 3)},"
                f" at most {_number(way['max'], 3)} {distance['unit']} ({way['samples']} samples)"
            )
    yield from _requirement_lines(report)


def _requirement_lines(report: dict[str, Any]) -> Iterator[str]:
    """Yield what is met of what was required in one line, and a line for each that is not."""
    verdicts = report.get("requirements", [])
    if met := [verdict["require"] for verdict in verdicts if verdict["met"]]:
        yield f"required  {', '.join(met)}: met"
    for verdict in verdicts:
        if not verdict["met"]:
            found = "no value" if verdict["found"] is None else _number(verdict["found"], 6)
            yield f"required  {verdict['require']}: not met ({found} was found)"


def volume_line(volume: dict[str, Any]) -> str:
    """Return the size, type, spacing and space of a volume in one line."""
    size = " x ".join(str(count) for count in volume["shape"])
    spacing = " x ".join(f"{length:.4g}" for length in volume["spacing_mm"])
    return f"{size} nodes of {volume['dtype']}, {spacing} mm, {_space_name(volume['space'])}"


def info_lines(description: dict[str, Any]) -> Iterator[str]:
    """Yield the lines of `dmc info`."""
    yield f"path      {description['path']}"
    if "shape" in description:
        yield f"format    {description['format']}, {description['files']} file(s)"
        yield f"volume    {volume_line(description)}"
        ends = description["value_range"]
        yield "values    " + ("none that is finite" if ends is None else f"{ends[0]:g} to {ends[1]:g}")
        if "kind" in description:
            yield f"kind      {description['kind']}"
        rows = description.get("labels", [])
        for row in rows[:_MOST_LABELS]:
            yield f"label     {_label(row)}: {row['nodes']} nodes"
        if len(rows) > _MOST_LABELS:
            yield f"          and {len(rows) - _MOST_LABELS} more; --json has them all"
        if (description["slope"], description["intercept"]) != (1.0, 0.0):
            yield f"scaling   {description['slope']:g} * stored value + {description['intercept']:g}"
        yield "affine    " + _matrix(description["affine"])
    if len(description["series"]) > 1 and "shape" not in description:
        yield "series    choose one with --series"
    dicom = len(description["series"]) > 1 or any(entry["uid"] for entry in description["series"])
    for entry in description["series"] if dicom else ():
        size = " x ".join(str(count) for count in entry["size"])
        parts = [f"{entry['number']:<4}", entry["modality"], size, entry["description"], entry["uid"]]
        yield "  " + "  ".join(part for part in parts if part)
    for entry in description["series"]:
        if len(entry["volumes"]) > 1:
            yield "volumes   choose one with --volume-index"
            shown = entry["volumes"][:_MOST_VOLUMES]
            yield from (f"  {number:<4}  {volume}" for number, volume in enumerate(shown))
            if len(entry["volumes"]) > len(shown):
                yield f"  and {len(entry['volumes']) - len(shown)} more; --json has them all"
    yield from _suggestion_lines(description)
    yield from _spectrum_lines(description.get("isovalues", []))
    for found in description.get("components", []):
        yield from _component_lines(found)
    yield from (f"warning   {warning}" for warning in _warnings(description))


def _suggestion_lines(description: dict[str, Any]) -> Iterator[str]:
    """Yield the isovalues that the values suggest, and their histogram with these marked."""
    suggested = description.get("suggested_isovalues", [])
    if suggested:
        told = ", ".join(f"{one['choice']} ({_number(one['isovalue'], 6)})" for one in suggested)
        yield f"isovalues {told}; the first one is taken without -i"
    if description.get("histogram") and not {"isovalues", "components"} & description.keys():
        yield from histogram_lines(description["histogram"], suggested)


def _component_lines(found: dict[str, Any]) -> Iterator[str]:
    """Yield the components of an object, the largest first."""
    told = f"{found['count']} component(s) at or above {short_number(found['isovalue'])}"
    yield f"parts     {told}, {found['specks']} of them specks under {_number(found['speck_volume'], 3)} mm³"
    if found["listed"]:
        yield "           nodes        mm³  from x y z to x y z, mm"
    for one in found["listed"][:_MOST_COMPONENTS]:
        low, high = (" ".join(f"{end:.6g}" for end in ends) for ends in one["bounds"])
        yield f"  {one['nodes']:>14}  {one['volume']:>9.6g}  {low} to {high}"
    if found["count"] > _MOST_COMPONENTS:
        yield f"  and {found['count'] - _MOST_COMPONENTS} more; --json lists the largest thousand"


def _spectrum_lines(rows: Sequence[dict[str, Any]]) -> Iterator[str]:
    """Yield a table of the surfaces over the range of values, the area as a bar beside it."""
    if not rows:
        return
    yield "  isovalue  active cells       %      area mm²  components"
    largest = max(row["area_mm2"] for row in rows)
    for row in rows:
        bar = "█" * round(_BAR * row["area_mm2"] / largest) if largest else ""
        yield (
            f"{short_number(row['isovalue']):>10}  {row['active_cells']:>12}  {row['active_percent']:6.2f}"
            f"  {row['area_mm2']:>12.6g}  {row['components']:>10}  {bar}".rstrip()
        )


def doctor_lines(diagnosis: dict[str, Any]) -> Iterator[str]:
    """Yield the lines of `dmc doctor`."""
    yield f"platform  {diagnosis['platform']}"
    yield f"python    {diagnosis['python']}"
    yield "packages  " + ", ".join(
        f"{name} {found or 'missing'}" for name, found in diagnosis["packages"].items()
    )
    for device in diagnosis["devices"]:
        memory = device["memory_bytes"]
        cores = f"{diagnosis['cpu_cores']} core(s)" if device["alias"] == "cpu" else ""
        yield f"device    {device['alias']}: {device['name']} {cores or f'{memory / 2**30:.1f} GiB'}"
    if len(diagnosis["devices"]) == 1:
        yield "device    cuda: no usable CUDA device was found; everything runs on the CPU"
    for name, available in diagnosis["codecs"].items():
        yield f"codec     DICOM {name}: {'available' if available else 'missing'}"
    launches = diagnosis["launches"]
    yield f"launches  {launches['fallback'] or str(launches['threads']) + ' CPU thread(s) share each'}"
    cache = diagnosis["kernel_cache"]
    size = cache["bytes"] / 2**20
    yield f"kernels   {cache['modules']} compiled module(s), {size:.1f} MiB in {cache['path']}"


def _warnings(report: dict[str, Any]) -> Iterator[str]:
    """Yield each warning's sentence with its code, which `docs/formats.md` explains."""
    for sentence, code in zip(report.get("warnings", []), report.get("warning_codes", []), strict=True):
        yield f"{sentence} ({code})"


def _label(row: dict[str, Any]) -> str:
    """Return a label's number, with its name where it has one."""
    return f"{row['label']} {row['name']}".strip()


def _surface_line(surface: dict[str, Any]) -> str:
    choice = surface.get("choice")
    if choice and choice["band"]:
        low, high = choice["band"]
        mapped = f"min(value - {low:g}, {high:g} - value)".replace("- -", "+ ")
        return f"of what lies from {low:g} to {high:g}: isovalue 0 of the trilinear {mapped}"
    text = f"isovalue {surface['isovalue']:g}"
    if choice and choice["chosen"]:
        text += f" ({choice['chosen']})"
    if surface["stored_isovalue"] != surface["isovalue"]:
        text += f", cut at the stored value {surface['stored_isovalue']:g}"
    return text


def _part_lines(part: dict[str, Any] | None) -> Iterator[str]:
    """Yield what was done to have a part of the volume."""
    if part is None:
        return
    if "table" in part:
        done = part["table"]
        size = f"{done['nodes']} nodes, {_number(done['volume'], 6)} mm³"
        found = f"{done['components']} piece(s) cut: {size}" if done["components"] else "none found"
        yield f"part      table: {found}"
    if "filtered" in part:
        size, spacing = (part["filtered"][key] for key in ("shape", "spacing"))
        yield (
            f"part      values at {' x '.join(map(str, size))} nodes,"
            f" {' x '.join(f'{length:.4g}' for length in spacing)} mm apart"
        )
    for key, name in (("opened", "taken away"), ("closed", "filled in gaps")):
        if key in part:
            yield f"part      {part[key]['nodes']} nodes {name}, {_number(part[key]['volume'], 6)} mm³"
    for key, name in (("dropped", "component(s) dropped"), ("filled", "cavit(ies) filled")):
        if key in part:
            done = part[key]
            what = name.replace("cavit(ies)", "cavity" if done["components"] == 1 else "cavities")
            size = f"{done['nodes']} nodes, {_number(done['volume'], 6)} mm³"
            yield f"part      {done['components']} {what}: {size}"
    if "dropped" not in part and part.get("components", {}).get("specks"):
        yield _speck_line(part["components"])


def _speck_line(found: dict[str, Any]) -> str:
    """Tell how many components are specks, and how they are dropped."""
    limit = _number(found["speck_volume"], 3)
    return (
        f"part      {found['count']} components, {found['specks']} of them specks under {limit} mm³; --keep"
        f" largest drops all but one, --min-volume {limit} the specks"
    )


def _choice_lines(choice: dict[str, Any] | None) -> Iterator[str]:
    """Yield why an isovalue was chosen where none was asked for, and what else there is."""
    if choice is None or choice["asked"] is not None:
        return
    others = [f"{name} ({_number(isovalue, 6)})" for name, isovalue in choice["others"].items()]
    if "otsu" not in (choice["chosen"], *choice["others"]):
        others.append("otsu")
    told = f"{choice['chosen']} is the default{', ' + choice['reason'] if choice['reason'] else ''}"
    yield f"isovalue  {told}; others by -i: {', '.join(others)} or a number; dmc info draws them"


def _mesh_line(mesh: dict[str, Any]) -> str:
    unit = "" if mesh["unit"] == "voxel" else f" {mesh['unit']}"
    text = f"{mesh['vertices']} vertices, {mesh['quads']} quads"
    if mesh.get("triangles"):
        text += f", {mesh['triangles']} triangles"
    if mesh.get("area") is not None:
        text += f", area {mesh['area']:.6g}{unit and unit + '²'}"
    if mesh.get("volume") is not None:
        text += f", volume {mesh['volume']:.6g}{unit and unit + '³'}"
    return text


def _size_line(size: dict[str, Any]) -> str:
    """Tell how many quads were taken away, and what stopped that."""
    text = f"{size['quads']} of {size['quads_before']} quads, {size['quads_wanted']} asked for"
    return text if size["reached"] else f"{text}; stopped by {size['stopped_by']}"


def _output_space(report: dict[str, Any]) -> str:
    """Name the axes of the mesh's coordinates, and their unit where it is not the usual one."""
    asked = report["settings"]["space"]
    if asked == "voxel":
        return "grid indices"
    name = _space_name(report["input"]["space"] if asked == "native" else asked.upper())
    unit = report["mesh"]["unit"]
    return name if unit == "mm" else f"{name} in {unit}"


def _space_name(space: str) -> str:
    return "no space" if space == "none" else space


def _topology_line(topology: dict[str, Any]) -> str:
    edges, vertices = topology["non_manifold_edges"], topology["non_manifold_vertices"]
    loops = topology["boundary_loops"]
    parts = [
        f"not manifold ({edges} edge(s), {vertices} vertices)" if edges or vertices else "manifold",
        f"open ({loops} boundary loop(s))" if loops else "closed",
        f"{topology['components']} component(s)",
    ]
    if topology.get("genus") is not None:
        parts.append(f"genus {topology['genus']:g}")
    return ", ".join(parts)


def _shape_line(mesh: dict[str, Any], quality: dict[str, Any]) -> str:
    """Tell the papers' two measures of shape and the scaled Jacobian, those of quads where there are any."""
    mean_ratio = f"mean ratio {_number(quality['mean_ratio_mean'], 4)}"
    if not mesh["quads"]:
        jacobian = _number(quality["triangle_scaled_jacobian_min"])
        return f"{mean_ratio}; scaled Jacobian of triangles at least {jacobian}"
    mean, least = _number(quality["shape_mean"], 4), _number(quality["shape_min"])
    jacobian = _number(quality["scaled_jacobian_min"])
    return f"mean {mean}, least {least}; {mean_ratio}; scaled Jacobian at least {jacobian}"


def _elements_line(mesh: dict[str, Any], quality: dict[str, Any]) -> str:
    """Tell the measures of finite elements, those of quads where there are any."""
    parts = []
    if mesh["quads"]:
        parts += [f"{name} at most {_number(quality[f'{key}_max'], 3)}" for name, key in _WORST]
        parts.append(f"stretch at least {_number(quality['stretch_min'])}")
    mean, least = _number(quality["radius_ratio_mean"], 4), _number(quality["radius_ratio_min"])
    return ", ".join([*parts, f"radius ratio of triangles mean {mean}, least {least}"])


def _intersections(quality: dict[str, Any]) -> str:
    """Tell how many pairs of faces intersect."""
    found = quality["self_intersections"]
    return f"{found} pair(s) intersect" if found else "no two intersect"


def _thickness_line(thickness: dict[str, Any], unit: str) -> str:
    """Tell how thick the walls are, and how much is thinner than was asked for."""
    if not thickness["vertices"]:
        return "unknown: no ray from a vertex meets a wall"
    least, median = _number(thickness["min"], 3), _number(thickness["median"], 3)
    text = f"at least {least} {unit}, of half the area at most {median} {unit}"
    if thickness["limit"] is not None:
        text += f"; {thickness['percent_below']:.2f} % of the area below {thickness['limit']:g} {unit}"
    return text


def _time_line(timings: dict[str, float]) -> str:
    stages = ", ".join(f"{name} {timings[name] / 1000:.2f}" for name in _SLOW_STAGES if timings.get(name))
    total = f"{timings['total'] / 1000:.2f} s"
    return f"{total} ({stages})" if stages else total


def _number(value: float | None, digits: int = 2) -> str:
    return "unknown" if value is None else f"{value:.{digits}g}"


def _matrix(rows: list[list[float]]) -> str:
    return "; ".join(" ".join(f"{value + 0.0:.6g}" for value in row) for row in rows[:3])
