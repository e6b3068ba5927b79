"""List table I of Schmitz, Dietrich & Comba 2009: triangles and their radius ratios on four scans.

Their scans are those of volvis.org. Copies that are about today differ from theirs: they are cropped or
resampled otherwise, or their air is cleared. So what is found comes near, and is no proof.
"""

from dmc_cli.reproduction.paper_values import (
    MACET,
    MARCHING,
    PARTICLE,
    SCHMITZ,
    MeshKind,
    PaperValue,
    Scan,
)

COPY = "today's copies of the scan differ from theirs"
STEPS = "today's copies of the scan differ; their fixed diagonal and number of steps are not told"
OWN = (
    "today's copies of the scan differ; the constants of Macet are not published, ours is a recipe of our own"
)

BACKPACK = Scan(name="backpack", isovalue=1000.5, nodes=512)
BONSAI = Scan(name="bonsai", isovalue=49.5, nodes=256)
ENGINE = Scan(name="engine", isovalue=49.5, nodes=256)
STENT = Scan(name="stent", isovalue=500.5, nodes=512)

SCANS = {scan.name: scan for scan in (BACKPACK, BONSAI, ENGINE, STENT)}
"""The scans by the name that `--scan` takes."""

_PRINTED: tuple[tuple[MeshKind, str, str, tuple[float, float, float, float]], ...] = (
    (MARCHING, "triangles", COPY, (2338896, 671296, 599024, 2823756)),
    (PARTICLE, "triangles", COPY, (2342608, 673048, 598920, 2826208)),
    (MARCHING, "radius_ratio_mean", COPY, (0.700012, 0.687802, 0.70733, 0.71089)),
    (PARTICLE, "radius_ratio_mean", STEPS, (0.766, 0.75725, 0.77274, 0.77473)),
    (MACET, "radius_ratio_mean", OWN, (0.81369, 0.82694, 0.81674, 0.80432)),
    (MARCHING, "radius_ratio_min", COPY, (1.525e-5, 1.373e-3, 4.232e-4, 1.709e-5)),
    (PARTICLE, "radius_ratio_min", STEPS, (1.785e-5, 1.138e-4, 6.55e-3, 1.502e-3)),
    (MACET, "radius_ratio_min", OWN, (0.44475, 0.47395, 0.51064, 0.45069)),
)

SCHMITZ_VALUES = tuple(
    PaperValue(SCHMITZ, scan, mesh, quantity, printed, "other_data", remark)
    for mesh, quantity, remark, row in _PRINTED
    for scan, printed in zip(SCANS.values(), row, strict=True)
)
"""All figures of the table, row by row."""
