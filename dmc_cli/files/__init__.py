"""Write outputs that are complete or not there at all.

atomic   a file that grows under another name and is renamed at the end
streams  standard output, as a place to write to
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
