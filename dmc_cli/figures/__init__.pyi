# What other folders use of this one; `__init__.py` says what it is for.

from .drawing import draw_figures as draw_figures
from .reproduced import draw_reproduction as draw_reproduction
from .style import prepare_figures as prepare_figures
