"""Name the types of NumPy's arrays by what is in them; shapes, units and order are told where one is used."""

from typing import Any

import numpy as np

AnyArray = np.ndarray[Any, np.dtype[Any]]
"""Of a type that a file, a caller or an option names: stored values, and values of vertices and faces."""

BoolArray = np.ndarray[Any, np.dtype[np.bool_]]
ByteArray = np.ndarray[Any, np.dtype[np.uint8]]
Int32Array = np.ndarray[Any, np.dtype[np.int32]]
Int64Array = np.ndarray[Any, np.dtype[np.int64]]
IntArray = np.ndarray[Any, np.dtype[np.signedinteger[Any]]]
"""Of either, or NumPy's own for indices, which has 32 bits on some systems."""

Float32Array = np.ndarray[Any, np.dtype[np.float32]]
Float64Array = np.ndarray[Any, np.dtype[np.float64]]
FloatArray = np.ndarray[Any, np.dtype[np.floating[Any]]]
"""Of either: what NumPy's linear algebra returns."""
