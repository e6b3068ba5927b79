# What other folders use of this one; `__init__.py` says what it is for.

from .bound import Bound as Bound
from .kernels import decimation_kernels as decimation_kernels
from .rounds import Decimated as Decimated, Decimation as Decimation, decimate as decimate
