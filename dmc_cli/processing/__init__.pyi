# What other folders use of this one; `__init__.py` says what it is for.

from .decimation import (
    Bound as Bound,
    Decimated as Decimated,
    Decimation as Decimation,
    decimate as decimate,
)
from .intersection_repair import Repaired as Repaired, repair_intersections as repair_intersections
from .kernels import kernel_modules as kernel_modules
from .patterns import Simplified as Simplified, simplify as simplify
from .relaxation import relax as relax
from .remeshing import Remeshed as Remeshed, Rounds as Rounds, remesh as remesh
