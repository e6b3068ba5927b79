# What other folders use of this one; `__init__.py` says what it is for.

from .kernels import pattern_kernels as pattern_kernels
from .simplification import Simplified as Simplified, simplify as simplify
