# What other folders use of this one; `__init__.py` says what it is for.

from .kernels import kernel_modules as kernel_modules
from .patterns.simplify import simplify as simplify
from .relaxation.relax import relax as relax
from .remeshing.rounds import Rounds as Rounds, remesh as remesh
