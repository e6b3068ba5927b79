"""An array in any form that a caller may have gives the surface of the same numbers."""

import numpy as np
import pytest

from dmc_cli.volume.volume import Volume
from tests.contouring.dual_marching_cubes.agreement import as_arrays

BALL = np.round(10 - np.linalg.norm(np.mgrid[-12:12:25j, -12:12:25j, -12:12:25j], axis=0), 2)

FORMS = {
    "big-endian": (lambda values: values.astype(">f4"), 0.5),
    "half floats": (lambda values: values.astype("f2").astype("f4").astype("f2"), 0.5),
    "truth values": (lambda values: values > 0.5, 0.5),
    "big-endian integers": (lambda values: (100 * values).astype(">i2"), 50),
    "columns first": (lambda values: np.asfortranarray(values.astype("f4")), 0.5),
    "every other node": (lambda values: np.repeat(values.astype("f4"), 2, axis=2)[:, :, ::2], 0.5),
}


@pytest.mark.parametrize("form", FORMS)
def test_the_form_of_an_array_does_not_show(extract, form):
    change, isovalue = FORMS[form]
    given = change(BALL)
    plain = {"?": "u1", "e": "f4"}.get(given.dtype.char, given.dtype.newbyteorder("="))
    surfaces = [
        extract(Volume(values=values, affine=np.eye(4), space="none"), isovalue)
        for values in (given, np.ascontiguousarray(given, plain))
    ]
    found, expected = (as_arrays(surface) for surface in surfaces)
    assert len(found["faces"]) > 1000
    for key, array in expected.items():
        np.testing.assert_array_equal(found[key], array)
