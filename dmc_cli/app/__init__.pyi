# What other folders use of this one; `__init__.py` says what it is for.

from .batch import convert_all as convert_all
from .comparison import (
    Comparison as Comparison,
    compare_methods as compare_methods,
    valences_of_passes as valences_of_passes,
)
from .conversion import (
    ConvertResult as ConvertResult,
    compile_kernels as compile_kernels,
    convert as convert,
    load_needed_kernels as load_needed_kernels,
)
from .junit import junit_text as junit_text, junit_written as junit_written
from .kept_volume import KeptVolume as KeptVolume
from .label_conversion import LabelResult as LabelResult, convert_labels as convert_labels
from .label_surfaces import (
    list_shells as list_shells,
    make_label_mesh as make_label_mesh,
    patch_volumes as patch_volumes,
)
from .measurement import measure_file as measure_file
from .object_components import list_object_components as list_object_components
from .outcomes import Outcome as Outcome
from .overlaps import refuse_overlaps as refuse_overlaps
from .preparation import prepare as prepare
from .read_ahead import ReadAhead as ReadAhead
from .rework import ReworkResult as ReworkResult, rework_file as rework_file
from .several import convert_each as convert_each
from .spectrum import contour_spectrum as contour_spectrum
