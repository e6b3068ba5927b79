"""Name the modules with kernels that a run needs, for loading them ahead of time."""

from types import ModuleType

from dmc_cli.methods import METHODS, method_named
from dmc_cli.settings import SurfaceSettings


def kernel_modules(
    settings: SurfaceSettings, *, normals_too: bool = True, indexed: bool = False
) -> list[ModuleType]:
    """Return the modules whose kernels a surface needs, for loading them ahead of time.

    `indexed` adds those that surfaces at several isovalues share. The one that takes longest to compile comes
    first, so that it is not the last to be ready.
    """
    modules = list(method_named(settings.method).kernels(settings))
    if indexed:
        from dmc_cli.contouring.stages import indexed_classification

        modules.append(indexed_classification)
    return [*normal_kernels(), *modules] if normals_too else modules


def normal_kernels() -> list[ModuleType]:
    """Return the modules whose kernels normals need."""
    from dmc_cli.contouring import normals

    return [normals]


def mesh_kernel_modules(method: str, *, colors: bool = False) -> list[ModuleType]:
    """Return the modules whose kernels connecting the faces needs, and colouring them if that is wanted."""
    from dmc_cli.mesh import connecting_kernels

    known = method_named(method)
    modules = list(known.mesh_kernels(colors=colors)) if known.mesh_kernels else []
    if known.connect is None:
        modules += connecting_kernels()
    if colors:
        from dmc_cli.contouring import vertex_colors

        modules.append(vertex_colors)
    return modules


def every_kernel_module() -> list[ModuleType]:
    """Return the modules of all methods, whatever is chosen of their options, each once."""
    modules: list[ModuleType] = []
    for name in METHODS:
        known = method_named(name)
        chosen = [{option: value} for option, values in known.options.items() for value in values]
        for options in chosen or [{}]:
            modules += kernel_modules(SurfaceSettings(isovalue=0.0, method=name, **options), indexed=True)  # type: ignore[arg-type]
        modules += mesh_kernel_modules(name, colors=known.color is not None)
    return list(dict.fromkeys(modules))
