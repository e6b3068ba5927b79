"""Philips' headers, written by hand: nibabel writes none."""

import numpy as np

GENERAL = """\
# === DATA DESCRIPTION FILE ===
# CLINICAL TRYOUT             Research image export tool     {version}
# === GENERAL INFORMATION ===
.    Patient name                       :   phantom
.    Max. number of echoes              :   {echoes}
.    Max. number of slices/locations    :   {slices}
.    Max. number of dynamics            :   {dynamics}
.    Repetition time [ms]               :   2000.000
.    Angulation midslice(ap,fh,rl)[degr]:   {angulation}
.    Off Centre midslice(ap,fh,rl) [mm] :   {centre}
.    Dynamic scan      <0=no 1=yes> ?   :   0
.    Diffusion         <0=no 1=yes> ?   :   0
# === IMAGE INFORMATION ===
"""

LINE = (
    "{slice} {echo} {dynamic} {phase} {kind} {sequence} {record} {bits} 62 {nx} {ny} {intercept} {slope} "
    "0.005 1070 1860 "
    "{angulation} {place} {thickness} {gap} 0 1 0 2 {dx} {dy} 28 0 0 0 1 90 0 0 0 39 0 1 1 7 0 0 0 0 1"
)


def par_header(shape, scales, spacing=(2.0, 3.0, 4.0), version="V4.2", order=None, **changes):
    """Return a .PAR of transverse slices.

    Args:
        shape: Nodes along x, y, z.
        scales: Slope and intercept of each slice, shape (dynamics, nz, 2).
        spacing: Along x, y, z in mm.
        version: Of the format.
        order: Places of the slices in the .REC, volume by volume; as they come where it is left out.
        changes: What stands in every line, or in the scan's own fields, instead.
    """
    nx, ny, nz = shape
    dynamics = len(scales)
    centre = changes.pop("centre", (7.0, -8.0, 9.0))
    told = {
        "slices": nz,
        "echoes": 1,
        "dynamics": dynamics,
        "angulation": "0 0 0",
        "version": version,
    } | changes
    order = range(nz * dynamics) if order is None else order
    lines = []
    for number, record in enumerate(order):
        dynamic, k = divmod(number, nz)
        up = centre[1] + (k - (nz - 1) / 2) * spacing[2]
        line = {
            "slice": k + 1,
            "echo": 1,
            "dynamic": dynamic + 1,
            "phase": 1,
            "sequence": 2,
            "kind": 0,
            "record": record,
            "bits": 16,
            "nx": nx,
            "ny": ny,
            "slope": scales[dynamic][k][0],
            "intercept": scales[dynamic][k][1],
            "angulation": told["angulation"],
            "place": f"{centre[0]} {up} {centre[2]}",
            "thickness": spacing[2] - 1,
            "gap": 1.0,
            "dx": spacing[0],
            "dy": spacing[1],
        }
        chosen = {key: told[key] for key in line.keys() & changes.keys()}
        found = {key: value[number] if isinstance(value, list) else value for key, value in chosen.items()}
        lines.append(LINE.format(**line | found))
    text = GENERAL.format(**told | {"centre": " ".join(map(str, centre))})
    return text + "\n".join(lines) + "\n"


def same_scales(dynamics, slices, slope=1.0, intercept=0.0):
    """Return one slope and intercept for all slices."""
    return np.tile([slope, intercept], (dynamics, slices, 1)).tolist()
