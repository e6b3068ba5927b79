"""Report what a run found, as JSON, and check what is required of it.

measures      topology, quality and deviation of a surface
memory        how much memory the run took
versions      what the result depends on
report        all of it, under the keys that scripts rely on
blamed_faces  the faces that keep a mesh from being as required
requirements  what `--require` asks of it
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
