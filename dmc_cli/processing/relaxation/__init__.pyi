# What other folders use of this one; `__init__.py` says what it is for.

from .kernels import relaxation_kernels as relaxation_kernels
from .step_checks import SLIVER as SLIVER
from .steps import find_normals as find_normals, measure_shapes as measure_shapes, relax as relax
