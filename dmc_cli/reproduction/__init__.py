"""Make the papers' tables again.

paper_tables   what the papers print
reproduce_run  their meshes, made and measured
reproduce      their tables, ours beside them
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
