# What other folders use of this one; `__init__.py` says what it is for.

from .checks import (
    check_path as check_path,
    check_run as check_run,
)
from .choices import (
    FACE_VALUES as FACE_VALUES,
    SIMPLIFIED as SIMPLIFIED,
    STREAM as STREAM,
    Element as Element,
    Inside as Inside,
    MeshValue as MeshValue,
    OutputSpace as OutputSpace,
    OutputUnit as OutputUnit,
    PaperTable as PaperTable,
    Simplify as Simplify,
    SyntheticField as SyntheticField,
    VolumeFormat as VolumeFormat,
)
from .comparison import (
    CompareSettings as CompareSettings,
)
from .conversion import (
    ConvertSettings as ConvertSettings,
    MemoryShare as MemoryShare,
)
from .labels import (
    LabelSettings as LabelSettings,
)
from .measurement import (
    MeasureSettings as MeasureSettings,
)
from .mesh import (
    SIZES as SIZES,
    MeshSettings as MeshSettings,
    repairs as repairs,
    wanted_quads as wanted_quads,
)
from .output import (
    OutputSettings as OutputSettings,
)
from .part import (
    PartSettings as PartSettings,
)
from .reading import (
    ReadSettings as ReadSettings,
)
from .reproduction import (
    ReproduceSettings as ReproduceSettings,
)
from .rework import (
    ReworkSettings as ReworkSettings,
)
from .surface import (
    SurfaceSettings as SurfaceSettings,
)
from .synthesis import (
    SynthSettings as SynthSettings,
)
from .types import (
    as_real as as_real,
    is_whole as is_whole,
)
