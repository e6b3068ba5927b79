# What other folders use of this one; `__init__.py` says what it is for.

from .kernels import remeshing_kernels as remeshing_kernels
from .rounds import Remeshed as Remeshed, Rounds as Rounds, remesh as remesh
