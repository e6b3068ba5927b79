"""Hypothesis: volumes and settings that hit ties, missing data, borders, slopes and every type."""

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dmc_cli.settings import SurfaceSettings
from tests.fields import volume_of

INTEGER_TYPES = ("uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64")
FLOAT_TYPES = ("float32", "float64")
LEVELS = (0.0, 0.5, 1.0, 1.75, 2.0, 3.0)
"""Isovalues in stored values, among the values themselves and between them."""

AFFINES = {
    "identity": np.eye(4),
    "anisotropic": np.array([[0.5, 0, 0, -3], [0, 2, 0, 4], [0, 0, 1.25, 7], [0, 0, 0, 1.0]]),
    "mirrored": np.diag([1.0, -1.0, 2.0, 1.0]),
    "turned": np.array([[0, -1, 0, 5], [1, 0, 0, 0], [0, 0, 3, 0], [0, 0, 0, 1.0]]),
}

shapes = st.tuples(*[st.integers(2, 4)] * 3)
small_integers = st.integers(0, 4)
small_floats = st.one_of(
    st.sampled_from([0.0, -0.0, 1.0, 2.0, 3.0]),
    st.floats(-4.0, 8.0, width=32),
    st.sampled_from([np.nan, np.inf, -np.inf]),
)


@st.composite
def volumes(draw):
    """A volume of up to four nodes an axis, with values near `LEVELS`."""
    dtype = np.dtype(draw(st.sampled_from(INTEGER_TYPES + FLOAT_TYPES)))
    elements = small_floats if dtype.kind == "f" else small_integers
    values = draw(arrays(np.float64, draw(shapes), elements=elements, fill=st.nothing()))
    return volume_of(
        values.astype(dtype),
        slope=draw(st.sampled_from([1.0, -1.0, 2.0, -0.5])),
        intercept=draw(st.sampled_from([0.0, 1.0, -1024.0])),
        padding=draw(st.sampled_from([None, None, (4.0, 4.0), (0.0, 0.0), (3.0, 100.0)])),
        affine=AFFINES[draw(st.sampled_from(list(AFFINES)))],
    )


@st.composite
def noise_volumes(draw):
    """A volume of up to six nodes an axis, of integer noise with ties or of normal noise."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    shape = draw(st.tuples(*[st.integers(2, 6)] * 3))
    dtype = np.dtype(draw(st.sampled_from(INTEGER_TYPES + FLOAT_TYPES)))
    if dtype.kind == "f":
        values = rng.normal(1.5, 1.0, shape).astype(dtype)
        values[rng.random(shape) < draw(st.sampled_from([0.0, 0.0, 0.05]))] = np.nan
    else:
        values = rng.integers(0, draw(st.sampled_from([2, 4, 7])), shape).astype(dtype)
    return volume_of(values, slope=draw(st.sampled_from([1.0, -1.0])))


@st.composite
def settings_for(draw, volume):
    """Settings at one of `LEVELS` of a volume's stored values."""
    return SurfaceSettings(
        isovalue=volume.slope * draw(st.sampled_from(LEVELS)) + volume.intercept,
        inside=draw(st.sampled_from(["above", "below"])),
        topology=draw(st.sampled_from(["manifold", "asymptotic"])),
        border=draw(st.sampled_from(["open", "closed"])),
        orientation=draw(st.sampled_from(["outward", "gradient"])),
    )


@st.composite
def volumes_with_settings(draw):
    """A small volume, and settings that cut it."""
    volume = draw(st.one_of(volumes(), noise_volumes()))
    return volume, draw(settings_for(volume))
