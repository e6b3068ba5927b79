# What other folders use of this one; `__init__.py` says what it is for.

from .conversion import echo_summaries as echo_summaries, summary_lines as summary_lines
from .description import info_lines as info_lines
from .diagnosis import doctor_lines as doctor_lines
from .labels import label_lines as label_lines
from .measurement import measure_lines as measure_lines
from .rework import rework_lines as rework_lines
