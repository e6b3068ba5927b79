"""Draw the papers' figures of a comparison. The only place that knows matplotlib.

style     sizes, colours and files that all figures have
curves    elements and vertices sorted by quality and deviation
valences  how many vertices have which valence, before and after each pass
drawing   all figures of a comparison
reproduced  those of a data set of the papers
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
