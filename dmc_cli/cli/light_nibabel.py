"""Import only those parts of nibabel that are asked for, in a process that is the command's own.

`import nibabel.nifti1` runs the whole package's `__init__` first, which imports every format that there is,
and pydicom for an extension of NIfTI: half a second, where the module with all that it needs takes less than
a tenth. So the command stands for the package with an empty one, and tells that one module that there is no
pydicom. A program that imports `dmc_cli` gets nibabel as it is.

This module is imported by every command: what it needs itself is imported where it is used.
"""

import sys
from typing import Any


class _Loader:
    """Loads a module as another loader does, between two calls of ours.

    Attributes:
        inner: The module's own loader.
        exec_module: Takes the module that was made, and fills it.
    """

    def __init__(self, inner: Any, exec_module: Any) -> None:
        self.inner = inner
        self.exec_module = exec_module

    def create_module(self, spec: Any) -> Any:
        """Return the module to be filled, or None for one of the usual kind."""
        return self.inner.create_module(spec)


class LightNibabel:
    """Finds the package and the module that are loaded otherwise: what `sys.meta_path` holds."""

    def __init__(self) -> None:
        self._threads: set[int] = set()  # those that import the module just now

    def find_spec(self, name: str, path: Any, target: Any = None) -> Any:
        """Return a module's own specification with a loader of ours, or None for what is none of ours.

        Raises:
            ModuleNotFoundError: pydicom is asked for by the module that is to do without.
        """
        if name not in ("nibabel", "nibabel.nifti1", "pydicom"):
            return None
        from importlib.machinery import PathFinder
        from threading import get_ident

        if name == "pydicom":
            if get_ident() in self._threads:
                raise ModuleNotFoundError("pydicom is not needed here", name=name)
            return None
        spec = PathFinder.find_spec(name, path, target)
        if spec is None:
            return None
        inner: Any = spec.loader

        def without_pydicom(module: Any) -> None:
            self._threads.add(get_ident())
            try:
                inner.exec_module(module)
            finally:
                self._threads.discard(get_ident())

        spec.loader = _Loader(inner, without_pydicom if path else lambda _package: None)  # type: ignore[assignment]
        return spec


def import_nibabel_lightly() -> None:
    """Let this process import modules of nibabel without the package's own `__init__`."""
    sys.meta_path.insert(0, LightNibabel())
