"""pytest in a process of its own, forked from one that has the heavy packages loaded."""

import multiprocessing
import os
import resource
import signal
import sys

PRELOADED = [
    "pytest",
    "numpy",
    "scipy.ndimage",
    "scipy.spatial",
    "scipy.sparse.csgraph",
    "warp",
    "click.testing",
    "rich.progress",
    "pydicom",
]
"""Starting is half of a short run, and most of it is loading these."""


def run_pytest(tree, arguments, settings, limit=None):
    """Run pytest in a tree; its status, or None if it took longer than `limit` seconds, and its output."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(PRELOADED)
    told = tree / "told.txt"
    process = context.Process(target=_in_child, args=(tree, arguments, settings, limit, told))
    process.start()
    process.join(limit)
    status = process.exitcode
    if status is None:
        os.killpg(process.pid, signal.SIGKILL)
        process.join()
    return status, told.read_text(errors="replace")


def _in_child(tree, arguments, settings, limit, told):
    os.setsid()
    if limit is not None:  # for a kernel that never ends, when whoever started it is gone
        resource.setrlimit(resource.RLIMIT_CPU, (int(limit) + 1, int(limit) + 1))
    output = os.open(told, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.environ.update(settings)
    os.chdir(tree)
    sys.path[:] = [str(tree), *(path for path in sys.path if path not in ("", os.getcwd()))]
    for name in [name for name in sys.modules if name.split(".")[0] == "tests"]:
        del sys.modules[name]
    import pytest

    status = pytest.main(arguments)
    sys.stdout.flush()
    os._exit(int(status))
