"""Compiled kernels called as Warp calls them: what they take is checked, and nothing of it is kept."""

import gc
import weakref

import pytest
import warp as wp

from dmc_cli.runtime.compiled_kernel import takes_structs
from tests.runtime.launcher import Launcher, count_visits_kernel, visits_of


@pytest.mark.pool
def test_an_array_of_another_type_is_refused_on_every_launch():
    shared = Launcher(1)
    visits_of(shared, 10, 1)
    for other in (
        wp.zeros(10, dtype=wp.float64, device="cpu"),
        wp.zeros((2, 5), dtype=wp.int32, device="cpu"),
    ):
        with pytest.raises(TypeError, match="count_visits_kernel"):
            shared.launch(count_visits_kernel, 10, [0, 1, other], 1)


@pytest.mark.parametrize("threads", [1, 2])
def test_no_array_of_a_launch_is_kept(threads):
    shared = Launcher(threads)
    visits = wp.zeros(100, dtype=wp.int32, device="cpu")
    shared.launch(count_visits_kernel, 100, [0, 1, visits], 1)
    gone = weakref.ref(visits)
    del visits
    gc.collect()
    assert gone() is None


@pytest.mark.pool
def test_how_kernels_take_their_arguments_is_read_from_their_source():
    source = Launcher(1).pool._kernels.lead.source
    assert takes_structs(source, "lead_kernel")
    assert takes_structs(source, "help_kernel")
    assert not takes_structs(source, "other_kernel")
    assert not takes_structs(source.replace("wp_args_lead", "args_lead"), "lead_kernel")
    assert not takes_structs(source.replace("*_wp_args)", "*_wp_args, int more)"), "lead_kernel")
