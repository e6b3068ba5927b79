"""List the elements that images are asked for: nothing else of a header is kept.

A study has many thousand files, and the private elements of each may be longer than its pixels.
"""

from dmc_cli.volume_io.dicom.increments import FACTORS, PAGES, PLACES, TIMES, VIEWS
from dmc_cli.volume_io.dicom.labels import DISCRIMINATORS, FRAME_DISCRIMINATORS
from dmc_cli.volume_io.dicom.makers import CREATORS, KINDS

COMPLEX = frozenset(
    (
        0x00041220,  # Directory Record Sequence
        0x00209222,  # Dimension Index Sequence
        0x00283000,  # Modality LUT Sequence
        0x00409096,  # Real World Value Mapping Sequence
        0x00540022,  # Detector Information Sequence
        0x00620002,  # Segment Sequence
        0x3004000C,  # Grid Frame Offset Vector
        0x52009229,  # Shared Functional Groups Sequence
        0x52009230,  # Per-frame Functional Groups Sequence
    )
)
"""Left to pydicom."""

_KIND = (
    0x00020002,  # Media Storage SOP Class UID
    0x00020010,  # Transfer Syntax UID
    0x00080060,  # Modality
)

_IDENTITY = (
    0x00041500,  # Referenced File ID
    0x00080018,  # SOP Instance UID
    0x00100020,  # Patient ID
    0x0020000D,  # Study Instance UID
    0x0020000E,  # Series Instance UID
    0x00200011,  # Series Number
    0x00200013,  # Instance Number
    0x00201002,  # Images in Acquisition
    0x00209161,  # Concatenation UID
    0x00209162,  # In-concatenation Number
    0x00209163,  # In-concatenation Total Number
    0x00540081,  # Number of Slices
    0x00541330,  # Image Index
)

_PLACE = (
    0x00180050,  # Slice Thickness
    0x00181114,  # Estimated Radiographic Magnification Factor
    0x00181164,  # Imager Pixel Spacing
    0x00182010,  # Nominal Scanned Pixel Spacing
    0x00209301,  # Image Position (Volume)
    0x00209302,  # Image Orientation (Volume)
    0x00209311,  # Dimension Organization Type
    0x00280030,  # Pixel Spacing
    0x00280034,  # Pixel Aspect Ratio
    0x00480006,  # Total Pixel Matrix Columns
    *PLACES,
)

_PIXELS = (
    0x00280002,  # Samples per Pixel
    0x00280004,  # Photometric Interpretation
    0x00280006,  # Planar Configuration
    0x00280008,  # Number of Frames
    0x00280010,  # Rows
    0x00280011,  # Columns
    0x00280100,  # Bits Allocated
    0x00280101,  # Bits Stored
    0x00280102,  # High Bit
    0x00280103,  # Pixel Representation
    0x00280106,  # Smallest Image Pixel Value
    0x00280120,  # Pixel Padding Value
    0x00280121,  # Pixel Padding Range Limit
)

_VALUES = (
    0x00080100,  # Code Value
    0x00281052,  # Rescale Intercept
    0x00281053,  # Rescale Slope
    0x00281054,  # Rescale Type
    0x00283002,  # LUT Descriptor
    0x00283004,  # Modality LUT Type
    0x00283006,  # LUT Data
    0x00409224,  # Real World Value Intercept
    0x00409225,  # Real World Value Slope
    0x00541001,  # Units
    0x00541102,  # Decay Correction
    0x0062000E,  # Maximum Fractional Value
    0x30040002,  # Dose Units
    0x3004000E,  # Dose Grid Scaling
)

_FRAMES = (
    0x00209057,  # In-stack Position Number
    0x00209157,  # Dimension Index Values
    0x00209165,  # Dimension Index Pointer
    0x00209421,  # Dimension Description Label
    0x00280009,  # Frame Increment Pointer
    0x00620001,  # Segmentation Type
    0x00620004,  # Segment Number
    0x00620005,  # Segment Label
    0x0062000B,  # Referenced Segment Number
    0x0062000D,  # Recommended Display CIELab Value
    *(*TIMES, *VIEWS, *PAGES, *FACTORS),
)

_FACTORS = (
    0x00189089,  # Diffusion Gradient Orientation
    *DISCRIMINATORS.values(),
    *(tag for _, tag in FRAME_DISCRIMINATORS.values()),
    *CREATORS,
    *KINDS,
)

WANTED = frozenset((*_KIND, *_IDENTITY, *_PLACE, *_PIXELS, *_VALUES, *_FRAMES, *_FACTORS)) - COMPLEX
"""Single elements of the data set; of those in a functional group a data set may have its own."""

OFFSETS = frozenset([0x7FE00001, 0x7FE00002])
"""Where the frames of compressed pixels begin, and their lengths: decoders ask for them."""
