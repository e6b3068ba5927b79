# What other folders use of this one; `__init__.py` says what it is for.

from .measures import measure_surface as measure_surface
from .memory import measure_memory as measure_memory
from .report import (
    SCHEMA as SCHEMA,
    Measures as Measures,
    RunFacts as RunFacts,
    build_report as build_report,
    components_section as components_section,
    extent_section as extent_section,
    input_section as input_section,
    measured_sections as measured_sections,
    quality_section as quality_section,
    report_text as report_text,
    topology_section as topology_section,
)
from .requirements import check_requirements as check_requirements, count_blame as count_blame
from .versions import collect_versions as collect_versions
