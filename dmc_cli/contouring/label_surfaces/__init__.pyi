# What other folders use of this one; `__init__.py` says what it is for.

from .kernels import label_kernels as label_kernels
from .net import LabelNet as LabelNet, extract_net as extract_net
from .shells import Shells as Shells, extract_shells as extract_shells
from .smoothing import NetSmoother as NetSmoother
