"""Summarise reports and descriptions in a few readable lines.

lines         what several summaries have
conversion    a surface made
rework        a mesh of a file changed
labels        surfaces of labels made
measurement   a mesh measured
description   what is in an input
diagnosis     what an installation has
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
