"""Make the options that commands share, each once from the settings field that it fills.

Name, default and choices come from the field in `settings/`, those that depend on the method of contouring
from what the methods declare; only the help text and its heading are added.

from_settings  an option from a field, settings from options
reading        input, noise
part           which part of the volume is wanted
surface        isovalue, method and what it has of its own
labels         which labels of a label map, and as what
mesh           simplification, remeshing, relaxation
output         files, report, requirements
run            device, threads, memory, verbosity
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
