"""Smooth a label net without shrinking it: stairs go, the volume of each label stays.

With its vertices at the cells' centres the net is the boundary of the voxels, and its volume their count.
From there every quad's swept volume is an exact account of what is owed. A round smooths the net, spreads
what that took or added over the surface, and gives it back along the normals. The first rounds average, which
takes stairs away quickly; the others even out the bending, which shrinks little and makes better normals.
Junctions of three labels and more are smoothed along their curves alone (Taubin 1995). No slot comes from an
atomic, every step gathers, and the number of rounds is fixed: the result is the same on any number of
threads.

Sources: Gibson, Constrained elastic surface nets, MICCAI 1998 (vertices stay in their cells); Taubin, A
signal processing approach to fair surface design, SIGGRAPH 1995 (filters).
"""

from typing import Any

import numpy as np
import warp as wp

from dmc_cli.array_types import IntArray
from dmc_cli.contouring.label_surfaces.folds import flag_folds_kernel, retreat_kernel
from dmc_cli.contouring.label_surfaces.links import link_vertices
from dmc_cli.contouring.label_surfaces.lost_volumes import shared_out
from dmc_cli.contouring.label_surfaces.net import LabelNet
from dmc_cli.contouring.label_surfaces.pieces import hold_pieces
from dmc_cli.contouring.label_surfaces.steps import (
    average_kernel,
    bend_kernel,
    find_parts_kernel,
    give_back_kernel,
    spread_kernel,
    unbend_kernel,
)
from dmc_cli.contouring.label_surfaces.swept_volumes import owe_kernel, sweep_kernel
from dmc_cli.progress import SILENT, Progress
from dmc_cli.runtime import ITEMS_A_CHUNK

AVERAGING, EVENING, GIVING = 4, 7, 3
"""Rounds that average, that even out the bending, and that only give back."""

STEPS = 14
"""Steps of smoothing a round."""

SPREADING, FIRST_SPREADING = 20, 40
"""Steps in which what is owed spreads over the surface, in a round, and of what the first move took."""

AVERAGE_SHARE, EVEN_SHARE = 0.5, 0.4
"""How far a vertex goes a step; more than 0.5 of the second would not be stable."""

TAUBIN = (0.5, -1.0 / (1.0 / 0.5 - 0.1))
"""Shares of steps along curves, in turn: Taubin's filter with a pass band of 0.1."""

LEAST_JACOBIAN = 0.15
"""Scaled Jacobian below which a quad counts as folded."""

UNFOLDING, GUARDED, GUARDS = 12, 4, 8
"""Rounds of taking back moves that fold quads, of giving back then, and of tries to do that unfolded."""


class NetSmoother:
    """Places the vertices of a label net.

    Attributes:
        net: The net.
        cells: The cell of each vertex by its lowest node, int64 (V,).
        local: Where it is in the cell, float32 vec3 (V,).
    """

    def __init__(self, net: LabelNet, spacing: tuple[float, float, float]) -> None:
        """Place each vertex at the mean of the middles of its crossed edges.

        Args:
            net: A conforming net.
            spacing: Distances of nodes along the axes, by which folds are measured.
        """
        self.net, self._device, count = net, net.device, net.vertex_count
        linked = link_vertices(net)
        hold_pieces(net, linked)
        self.cells, self._links, self._start = linked.cells, linked.links, linked.start
        largest = max(spacing)
        self._spacing = wp.vec3(*[step / largest for step in spacing])
        empty = self._device.empty
        self._moved, self._bend, self._normal = (empty(count, wp.vec3) for _ in range(3))
        self._parts, self._spare = self._device.zeros(count, wp.vec2), empty(count, wp.vec2)
        self._part, self._swept = empty(count, wp.float32), empty(net.quad_count, wp.vec4)
        self._lost = self._device.zeros(net.quad_count, wp.float32)
        self._flags = empty(net.quad_count, wp.uint8)
        self._vertices(find_parts_kernel, [], [self._part])
        centre = empty(count, wp.vec3)
        centre.fill_(wp.vec3(0.5, 0.5, 0.5))
        self.local = empty(count, wp.vec3)
        wp.copy(self.local, self._start)
        self._owe(centre, self.local)
        self._spread(FIRST_SPREADING)

    def run(self, progress: Progress = SILENT) -> bool:
        """Smooth, give back what that takes, and unfold; return whether something is left to give back."""
        rounds = AVERAGING + EVENING + GIVING
        for number in range(rounds):
            if number < AVERAGING:
                self._smooth(average_kernel, AVERAGE_SHARE)
            elif number < AVERAGING + EVENING:
                self._smooth(unbend_kernel, EVEN_SHARE)
            elif number == AVERAGING + EVENING:
                self._owe_lost()
            self._give_back()
            progress.advance((number + 1) / rounds)
        return self._unfold()

    def retreat(self, quads: IntArray, share: float = 1.0, refuge: Any | None = None) -> None:
        """Move the vertices of some quads a share of the way back, and owe what that sweeps.

        They are given by their numbers, and go back to `refuge`, places of all vertices, or where they began.
        """
        flags = np.zeros(self.net.quad_count, np.uint8)
        flags[quads] = 1
        flagged = wp.array(flags, dtype=wp.uint8, device=self._device.name)
        wp.copy(self._moved, self.local)
        safe = self._start if refuge is None else refuge
        self._vertices(retreat_kernel, [flagged, safe, share], [self._moved])
        self._take()

    def folded(self) -> IntArray:
        """Return the numbers of the quads that fold."""
        self._finds_folds(self.local)
        found: IntArray = np.flatnonzero(self._flags.numpy())
        return found

    def give_back(self) -> None:
        """Give back what is owed as long as no quad folds."""
        self._owe_lost()
        for _ in range(GUARDED):
            self._give_back(guarded=True)

    def _smooth(self, kernel: Any, share: float) -> None:
        """Do the smoothing steps of a round, and owe what they sweep."""
        wp.copy(self._moved, self.local)
        for step in range(STEPS):
            self._vertices(bend_kernel, [self._moved], [self._bend])
            self._vertices(kernel, [self._bend, share, TAUBIN[step % 2]], [self._moved])
        self._take()

    def _give_back(self, *, guarded: bool = False) -> None:
        """Spread what is owed over the surface, and give it back; of guarded moves none that folds a quad."""
        self._spread(SPREADING)
        self._vertices(give_back_kernel, [self.local, self._normal, self._parts], [self._moved])
        if guarded and not self._take_back_folds():
            wp.copy(self._moved, self.local)
        self._take()

    def _take_back_folds(self) -> bool:
        """Take back the moves of vertices of quads that fold; return whether none does any more."""
        for _ in range(GUARDS):
            if not self._finds_folds(self._moved):
                return True
            self._vertices(retreat_kernel, [self._flags, self.local, 1.0], [self._moved])
        return False

    def _unfold(self) -> bool:
        """Take back what folds quads; return whether there was any."""
        for number in range(UNFOLDING):
            if not self._finds_folds(self.local):
                return number > 0
            wp.copy(self._moved, self.local)
            self._vertices(retreat_kernel, [self._flags, self._start, 0.5], [self._moved])
            self._take()
        return True

    def _finds_folds(self, local: Any) -> bool:
        """Flag the quads that fold where vertices are at some places; return whether there is any."""
        inputs = [self.net.faces, self.net.frames, local, self._spacing, LEAST_JACOBIAN]
        self._device.launch(flag_folds_kernel, self.net.quad_count, inputs, [self._flags], ITEMS_A_CHUNK)
        return bool(self._flags.numpy().any())

    def _take(self) -> None:
        """Let the vertices be where they have moved, and owe what that sweeps."""
        self._owe(self.local, self._moved)
        self.local, self._moved = self._moved, self.local

    def _owe(self, before: Any, after: Any) -> None:
        """Add to what vertices owe what their quads sweep in a move; find their normals after it."""
        inputs = [self.net.faces, self.net.frames, self._links.kind, before, after]
        outputs = [self._lost, self._swept]
        self._device.launch(sweep_kernel, self.net.quad_count, inputs, outputs, ITEMS_A_CHUNK)
        self._vertices(owe_kernel, [self._swept, self._part], [self._parts, self._normal])

    def _owe_lost(self) -> None:
        """Let vertices owe what quads without a regular corner have swept."""
        lost = self._lost.numpy().astype(np.float64)
        if not lost.any():
            return
        part, parts = self._part.numpy(), self._parts.numpy().copy()
        owing = np.flatnonzero(part > 0)
        sides = self.net.sides.numpy()
        first = self._links.quads.numpy()[self._links.quad_start.numpy()[owing]]
        areas = parts[owing, 1].astype(np.float64) / part[owing]
        owed = shared_out(lost, sides, sides[first], areas)
        parts[owing, 0] += (part[owing] * owed).astype(np.float32)
        self._parts.assign(parts)
        self._lost.zero_()

    def _spread(self, steps: int) -> None:
        """Spread what is owed, and the areas, over the surface."""
        for _ in range(steps):
            self._vertices(spread_kernel, [self._part, self._parts], [self._spare])
            self._parts, self._spare = self._spare, self._parts

    def _vertices(self, kernel: Any, inputs: list[Any], outputs: list[Any]) -> None:
        """Launch a kernel of one thread a vertex that takes the links first."""
        self._device.launch(kernel, self.net.vertex_count, [self._links, *inputs], outputs, ITEMS_A_CHUNK)
