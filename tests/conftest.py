"""Share with all tests the devices, the sample volumes, the profiles of hypothesis."""

import gc
import subprocess
import sys
from pathlib import Path

import hypothesis
import pytest

ROOT = Path(__file__).resolve().parent.parent

hypothesis.settings.register_profile(
    "default", deadline=None, print_blob=True, derandomize=True, max_examples=60
)
hypothesis.settings.register_profile("thorough", deadline=None, print_blob=True, max_examples=1000)
hypothesis.settings.load_profile("default")


def pytest_addoption(parser):
    parser.addoption(
        "--require-cuda",
        action="store_true",
        help="fail the tests that need a CUDA device, instead of skipping them, where there is none",
    )
    parser.addoption(
        "--launches-by-warp",
        action="store_true",
        help="launch as with a version of Warp whose compiled kernels are called otherwise, on one thread",
    )
    parser.addoption(
        "--any-warp",
        action="store_true",
        help="take the installed Warp for a known version: launch as with one, and fail where that is wrong",
    )
    parser.addoption(
        "--checked",
        action="store_true",
        help="have every memory access of the kernels checked; one beside its array ends the process",
    )


def pytest_configure(config):
    if config.getoption("--checked"):
        from tests.checked.bounds import check_bounds

        check_bounds()


def pytest_sessionstart(session):
    """Compile the kernels on all cores before several processes run all tests: each would compile them."""
    config = session.config
    is_whole = config.args_source is pytest.Config.ArgsSource.TESTPATHS
    if is_whole and config.getoption("numprocesses", None) and not hasattr(config, "workerinput"):
        command = [sys.executable, "-m", "dmc_cli", "doctor", "--warm-up", "--quiet"]
        subprocess.run(command, check=True, cwd=ROOT, stdout=subprocess.DEVNULL)


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Have no garbage sought among what stays to the end: thousands of tests, and all that they import."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()


def pytest_runtest_setup(item):
    if item.get_closest_marker("pool") and item.config.getoption("--launches-by-warp"):
        pytest.skip("there is no pool where launches are Warp's")


@pytest.fixture(scope="session", autouse=True)
def launches(request):
    """Have the way of launching that the options ask for, in the process of the tests."""
    if request.config.getoption("--any-warp"):
        import warp as wp

        from dmc_cli.runtime import compiled_kernel

        compiled_kernel.KNOWN_VERSIONS += (".".join(wp.config.version.split(".")[:2]),)
    if request.config.getoption("--launches-by-warp"):
        from dmc_cli.runtime import worker_pool

        worker_pool.takes_structs = lambda source, kernel: False
        assert worker_pool.worker_pool().fallback


@pytest.fixture(scope="session")
def has_cuda():
    import warp as wp

    wp.config.quiet = True
    wp.init()
    return wp.is_cuda_available()


@pytest.fixture(params=["cpu", pytest.param("cuda:0", marks=pytest.mark.gpu)])
def device(request):
    """The name of each device in turn; a test with it proves the same fact on CPU and on CUDA."""
    if request.param != "cpu" and not request.getfixturevalue("has_cuda"):
        if request.config.getoption("--require-cuda"):
            pytest.fail("no CUDA device is usable, and --require-cuda asks for one")
        pytest.skip("no CUDA device is usable")
    return request.param


@pytest.fixture
def extract(device):
    """Extract a surface on each device: `extract(volume, isovalue, threads=..., **settings)`."""
    from dmc_cli.settings import SurfaceSettings
    from tests.contouring.dual_marching_cubes.agreement import extract_on

    def run(volume, isovalue=0.0, *, threads=1, **settings):
        return extract_on(device, volume, SurfaceSettings(isovalue=isovalue, **settings), threads=threads)

    return run


@pytest.fixture(scope="session")
def sample_data():
    """The folder of small real volumes that come with the project."""
    return ROOT / "sample_data"


@pytest.fixture(scope="session")
def shared_data():
    """The folder of further real volumes, which lies beside the checkout on some machines."""
    return _beside_checkout("data")


@pytest.fixture(scope="session")
def shared_reference():
    """The folder of reference counts, which lies beside the checkout on some machines."""
    return _beside_checkout("reference")


def _beside_checkout(name):
    path = ROOT.parent / "shared" / name
    if not path.is_dir():
        pytest.skip(f"{path} is not on this machine")
    return path


@pytest.fixture
def run():
    """Call `dmc` in this process; an unexpected exception fails the test with its traceback."""
    from click.testing import CliRunner

    from dmc_cli.cli import dmc

    def call(*words, input=None):
        result = CliRunner().invoke(dmc, [str(word) for word in words], input=input)
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return result

    return call


@pytest.fixture
def run_process():
    """Call `dmc` in a process of its own, as a shell does."""

    def call(*words, timeout=200, **options):
        command = [sys.executable, "-m", "dmc_cli", *(str(word) for word in words)]
        return subprocess.run(
            command, capture_output=True, encoding="utf-8", timeout=timeout, check=False, **options
        )

    return call
