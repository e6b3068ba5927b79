"""Every kernel module compiles ahead of time for CUDA, without a GPU."""

import importlib
import pkgutil

import pytest
import warp as wp

import dmc_cli
from dmc_cli.app.conversion import every_kernel

ARCHITECTURES = [75, pytest.param(90, marks=pytest.mark.slow)]
"""Seconds a module and architecture; the second one finds what the first one misses only rarely."""

LARGE = {
    "dmc_cli.processing.decimation.sweep",
    "dmc_cli.processing.remeshing.mend",
    "dmc_cli.processing.remeshing.sweep",
}
"""Modules that take half a minute each."""

QUICKLY = "debug"
"""The mode that finds what does not compile as well as the default, without optimising it."""


def kernel_modules() -> list[str]:
    """Names of the package's modules that hold Warp kernels."""
    found = []
    for module in pkgutil.walk_packages(dmc_cli.__path__, "dmc_cli."):
        if module.name.endswith("__main__") or not imports_warp(module):
            continue
        importlib.import_module(module.name)
        if wp.get_module(module.name).kernels:
            found.append(module.name)
    return found


def imports_warp(module: pkgutil.ModuleInfo) -> bool:
    """Whether a module's source imports Warp: the others need not be imported."""
    source = module.module_finder.find_spec(module.name).loader.get_source(module.name)
    return "import warp as wp" in source


def test_contouring_has_kernel_modules():
    assert any(name.startswith("dmc_cli.contouring.") for name in kernel_modules())


def test_a_warm_up_compiles_them_all():
    assert {module.__name__ for module in every_kernel()} == set(kernel_modules())


@pytest.mark.parametrize("architecture", ARCHITECTURES)
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in LARGE else ()) for name in kernel_modules()]
)
def test_every_kernel_is_in_the_module_compiled_for_cuda(name, architecture, tmp_path, monkeypatch):
    module = wp.get_module(name)
    if architecture == ARCHITECTURES[0] and name not in LARGE:
        monkeypatch.setitem(module.options, "mode", QUICKLY)
    paths = wp.compile_aot_module(module, arch=architecture, module_dir=tmp_path, use_ptx=True)
    assert [path.suffix for path in paths] == [".ptx"]
    sources = "".join(path.read_text() for path in tmp_path.rglob("*.cu"))
    missing = [key for key in module.kernels if f"{key}_" not in sources]
    assert missing == []
