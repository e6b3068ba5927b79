"""Offer the options of label maps."""

from dmc_cli.cli.options.from_settings import setting, stack
from dmc_cli.cli.parameters import NameList, complete_files
from dmc_cli.settings import LabelSettings

label_options = stack(
    setting(
        LabelSettings,
        "labels",
        section="Labels",
        type=NameList(),
        again=NameList.again,
        help="Make a smooth closed shell of each label of a label map, not a surface at an isovalue: all, or"
        " numbers or names with commas between. OUTPUT is a template with {label} or {name} in it, or a file"
        " of a format that has groups. --quads, --edge-length and --max-error are of each shell.",
    ),
    setting(
        LabelSettings,
        "conforming",
        section="Labels",
        is_flag=True,
        help="One mesh of all labels, with shared interfaces; each face has the labels of its two sides. It"
        " has no normals: vertices where labels meet have several.",
    ),
    setting(
        LabelSettings,
        "label_names",
        section="Labels",
        metavar="FILE",
        shell_complete=complete_files,
        help="A table of the labels' names and colours: of ITK-SNAP, FreeSurfer, 3D Slicer (.ctbl), or BIDS"
        " (dseg.tsv). Without it those of the input count, or of the table of BIDS beside it.",
    ),
)
