"""Name the modules with kernels that a run needs, for loading them ahead of time."""

from types import ModuleType


def kernel_modules(
    *,
    intersections: bool,
    curvature: bool = False,
    distance: bool = False,
    lists: bool = False,
    thickness: bool = False,
) -> list[ModuleType]:
    """Return the modules whose kernels a report needs, for loading them ahead of time.

    Args:
        intersections: Whether they are counted.
        curvature: Whether it is measured.
        distance: Whether that from another mesh is measured.
        lists: Whether measures are listed face by face and vertex by vertex.
        thickness: Whether that of walls is measured.
    """
    from dmc_cli.measures import (
        component_list,
        components,
        deviation,
        elements,
        quality,
        rounding_kernels,
        vertex_fans,
    )
    from dmc_cli.mesh import connecting_kernels

    modules = [components, deviation, rounding_kernels, quality, elements, *connecting_kernels(), vertex_fans]
    modules.append(component_list)
    if intersections:
        modules += finding_kernels()
    if curvature:
        from dmc_cli.measures import curvature as bending, split_faces

        modules += [split_faces, bending]
    if thickness:
        modules += thickness_kernels()
    if distance:
        modules += distance_kernels()
    return modules + list_kernels() if lists else modules


def distance_kernels(*, proves: bool = False) -> list[ModuleType]:
    """Return the modules whose kernels measure the distance of two meshes, or prove a bound of it, too."""
    from dmc_cli.measures import nearest, quality, sampling, split_faces
    from dmc_cli.mesh import connecting_kernels, tree_kernels

    modules = [*tree_kernels(), *connecting_kernels(), quality, split_faces, sampling, nearest]
    if proves:
        from dmc_cli.measures import proximity

        modules.append(proximity)
    return modules


def quality_kernels() -> list[ModuleType]:
    """Return the modules whose kernels measure the quality of a mesh."""
    from dmc_cli.measures import quality

    return [quality]


def thickness_kernels() -> list[ModuleType]:
    """Return the modules whose kernels find how thick walls are."""
    from dmc_cli.measures import quality, split_faces, thickness
    from dmc_cli.mesh import connecting_kernels, tree_kernels

    return [*tree_kernels(), *connecting_kernels(), quality, split_faces, thickness]


def list_kernels() -> list[ModuleType]:
    """Return the modules whose kernels list measures face by face and vertex by vertex."""
    from dmc_cli.measures import lists

    return [lists]


def finding_kernels() -> list[ModuleType]:
    """Return the modules whose kernels find where a mesh intersects itself."""
    from dmc_cli.measures import intersections, split_faces
    from dmc_cli.mesh import tree_kernels

    return [intersections, split_faces, *tree_kernels()]
