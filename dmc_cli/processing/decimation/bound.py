"""Hold a distance between the fine mesh and the coarse one that is proven, not only sampled.

What judges a collapse looks at points. So as often as a quarter of the quads has gone, and at last, the whole
mesh is asked whether every point is within the bound, both ways. If so it is kept; if not, the rounds return
to the mesh that was kept last, and vertices stay there from now on where it went wrong. So what is returned
is always proven.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import warp as wp

from dmc_cli.array_types import BoolArray
from dmc_cli.mesh import Mesh, WorkingMesh, with_room
from dmc_cli.processing.distance_guard import TrackedPoints
from dmc_cli.processing.remeshing import FROZEN

SHARE = 0.7
"""How much of the bound collapses may use, as their samples know it."""

CHECKED_SHARE = 0.75
"""A mesh is checked that has no more quads than so many of those that the last one had."""

MOST_RETURNS = 8
"""Returns to the same mesh, at most."""

MOST_RINGS = 4
"""Quads that are to blame without a point of their own have their neighbours' points, so far away at most."""


@dataclass(frozen=True)
class Bound:
    """How far the fine mesh and the coarse one may be apart, and who says where they are.

    Attributes:
        distance: In the unit of the mesh's coordinates.
        find_beyond: Returns which quads of a mesh are to blame for more, bool (Q,); the mesh is read only.
    """

    distance: float
    find_beyond: Callable[[Mesh], BoolArray]


@dataclass(frozen=True)
class State:
    """A mesh between rounds, with the points that are tracked, and how far the rules are eased."""

    mesh: WorkingMesh
    tracked: TrackedPoints
    eased: int


class Keeper:
    """Keeps the last mesh that was proven."""

    def __init__(self, bound: Bound, state: State) -> None:
        """Keep the mesh that is given: it is within the bound."""
        self._bound, self._returns = bound, 0
        self._kept = _copied(state)

    def is_due(self, faces: int) -> bool:
        """Return whether a mesh of so many quads has lost enough to be checked."""
        return faces <= CHECKED_SHARE * self._kept.mesh.face_count

    def next_state(self, mesh: Mesh, state: State) -> tuple[State, bool]:
        """Return what to go on with, and whether that is the state that was given.

        Args:
            mesh: The state's mesh in the coordinates that the bound is in.
            state: What there is; each point's quad is the nearest one.
        """
        beyond = self._bound.find_beyond(mesh)
        if not beyond.any():
            self._returns, self._kept = 0, _copied(state)
            return state, True
        self._returns += 1
        if self._returns < MOST_RETURNS:
            self._freeze(beyond, mesh, state.tracked.nearest_quad.numpy())
        return _copied(self._kept), False

    @property
    def is_given_up(self) -> bool:
        """Return whether nothing more was found that holds, and the kept mesh is the last one."""
        return self._returns >= MOST_RETURNS

    def _freeze(self, beyond: BoolArray, mesh: Mesh, nearest_quad: Any) -> None:
        """Freeze the kept vertices near quads that are to blame, as the tracked points know it."""
        kept, twin = self._kept, mesh.require_halfedges().twin.numpy().reshape(-1, 4)
        frozen = kept.mesh.vertex_values[FROZEN].numpy()
        corners = kept.mesh.arrays.corners.numpy().reshape(-1, 4)
        for _ring in range(MOST_RINGS):
            to_blame = (nearest_quad >= 0) & beyond[nearest_quad]
            found = corners[kept.tracked.nearest_quad.numpy()[to_blame]]
            if not frozen[found].all():
                frozen[found] = 1
                break
            beyond = beyond | ((twin >= 0) & beyond[twin >> 2]).any(axis=1)
        else:
            self._returns = MOST_RETURNS
        device = kept.mesh.device
        kept.mesh.vertex_values[FROZEN].assign(wp.array(frozen, dtype=wp.uint8, device=device.name))


def _copied(state: State) -> State:
    """Return a state of its own: rounds change a mesh in place."""
    tracked = TrackedPoints(state.tracked.point, wp.clone(state.tracked.nearest_quad))
    return State(with_room(state.mesh, 0), tracked, state.eased)
