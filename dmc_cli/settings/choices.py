"""Name what settings are chosen from."""

from typing import Literal

ByteOrder = Literal["little", "big"]
SliceGaps = Literal["refuse", "keep"]
Duplicates = Literal["refuse", "first"]
SliceOrder = Literal["position", "instance", "location", "filename"]
Inside = Literal["above", "below"]
Topology = Literal["manifold", "asymptotic"]
Border = Literal["open", "closed"]
Triangulation = Literal["best", "standard"]
Gradients = Literal["differences", "exact"]
Simplify = Literal["none", "3x3y", "3333", "all"]
SimplifyRules = Literal["safe", "paper"]
Orientation = Literal["outward", "gradient"]
OutputSpace = Literal["native", "ras", "lps", "voxel", "tkr"]
MeshSpace = Literal["native", "ras", "lps"]
OutputUnit = Literal["mm", "um", "nm", "m"]
SyntheticField = Literal[
    "genus_two", "iwp", "neovius", "kummer", "steiner", "sphere", "torus", "box", "csg", "noise"
]
VolumeFormat = Literal["nifti", "nrrd", "meta", "raw"]
PaperTable = Literal["2", "3", "4", "5", "6", "7", "8", "9", "I"]

Element = Literal["S4R", "S4", "M3D4", "SFM3D4", "R3D4"]
MeshValue = Literal["quality", "deviation", "valence", "thickness"]

FACE_VALUES = ("quality",)
"""Values that a face has; the others are values of a vertex."""

METHOD_OPTIONS = ("topology", "placement", "triangulation", "border", "gradients")
"""Options of the surface that a method has or has not."""

METHOD_NUMBERS = ("steps", "step_size")
"""Numbers of the surface that a placement of a method takes or not."""

SIMPLIFIED = "+simplify"
"""What stands behind a method that is compared with its quads simplified."""

STREAM = "-"
"""The path that means standard input or standard output."""
