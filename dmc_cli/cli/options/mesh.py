"""Offer the options of what is done to a mesh before it is written."""

from dmc_cli.cli.options.from_settings import setting, stack
from dmc_cli.settings import MeshSettings

mesh_options = stack(
    setting(
        MeshSettings,
        "simplify",
        section="Mesh",
        help="Remove quads by the valences of their vertices: the pattern 3-X-3-Y, 3-3-3-3, or both.",
    ),
    setting(
        MeshSettings,
        "simplify_rules",
        section="Mesh",
        help="Keep the mesh manifold and unfolded, or follow the papers' bare rules.",
    ),
    setting(
        MeshSettings,
        "project",
        "--project/--no-project",
        section="Mesh",
        is_flag=True,
        help="Put the vertices of simplification back on the surface.",
    ),
    setting(
        MeshSettings,
        "remesh",
        section="Mesh",
        type=int,
        metavar="ROUNDS",
        help="Reduce irregular vertices in ROUNDS rounds of edge rotations, quad collapses and splits; 20 do"
        " most of it. Implies --simplify all.",
    ),
    setting(
        MeshSettings,
        "quads",
        section="Mesh",
        type=str,
        metavar="N|P%",
        help="Take quads away until N, or P percent, are left, by collapses that keep the mesh manifold,"
        " unfolded and near the surface.",
    ),
    setting(
        MeshSettings,
        "edge_length",
        section="Mesh",
        type=float,
        metavar="MM",
        help="Take quads away until sides are so long on average; instead of --quads.",
    ),
    setting(
        MeshSettings,
        "max_error",
        section="Mesh",
        type=float,
        metavar="MM",
        help="Take quads away only as far as every point stays so near to the mesh before, and that to every"
        " point of the new one; alone, as many as that lets.",
    ),
    setting(
        MeshSettings,
        "relax",
        section="Mesh",
        type=int,
        metavar="N",
        help="Smooth on the surface in N steps: vertices glide to where quads have better shapes.",
    ),
    setting(
        MeshSettings,
        "repair_intersections",
        "--repair-intersections/--no-repair-intersections",
        section="Mesh",
        is_flag=True,
        show_default="where quads are changed, or none may be by --require",
        help="Pull faces apart that intersect: their vertices go towards their neighbours.",
    ),
)
