"""Offer the options of which part of a volume is wanted."""

from dmc_cli.cli.options.from_settings import setting, stack
from dmc_cli.settings import PartSettings

part_options = stack(
    setting(
        PartSettings,
        "crop",
        section="Part",
        type=str,
        metavar="X,Y,Z",
        help="Keep a box of nodes, first:last for x, y and z, both kept: in nodes, mm of the volume's space,"
        " or % of its extent, as in 10:200,:,25%:75%.",
    ),
    setting(
        PartSettings,
        "cut_table",
        section="Part",
        is_flag=True,
        help="Take away what a scan's body lies on: thin wide things beside it that go along the slices.",
    ),
    setting(
        PartSettings,
        "resample",
        section="Part",
        type=str,
        metavar="MM|isotropic",
        help="Take values at nodes so far apart, or as the nearest ones are; means where that is more.",
    ),
    setting(
        PartSettings,
        "smooth_volume",
        section="Part",
        type=float,
        metavar="SIGMA_MM",
        help="Smooth the values by a Gaussian of this standard deviation.",
    ),
    setting(
        PartSettings,
        "open_gaps",
        section="Part",
        type=float,
        metavar="MM",
        help="Take away what of the object is thinner than this, bridges for example.",
    ),
    setting(
        PartSettings,
        "close_gaps",
        section="Part",
        type=float,
        metavar="MM",
        help="Fill gaps and holes in the object that are narrower than this.",
    ),
    setting(
        PartSettings,
        "keep",
        section="Part",
        type=str,
        metavar="largest|N",
        help="Keep the largest component of the object, or the N largest.",
    ),
    setting(
        PartSettings,
        "min_volume",
        section="Part",
        type=float,
        metavar="MM3",
        help="Drop the object's components of less than this volume.",
    ),
    setting(
        PartSettings,
        "fill_cavities",
        section="Part",
        type=str,
        metavar="[MM3]",
        is_flag=False,
        flag_value="all",
        help="Fill what the object encloses, all of it or cavities of at most this volume.",
    ),
)
