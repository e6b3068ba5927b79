"""The volume: values on a grid and where they lie in the world. Nothing here imports Warp."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
