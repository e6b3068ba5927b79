"""Run the stages of Macet one by one, and hand out what is between them."""

from dataclasses import dataclass

import numpy as np
import warp as wp

from dmc_cli.contouring.macet.extraction import Moves
from dmc_cli.contouring.stages.edge_surface import find_edges
from dmc_cli.field import upload_volume
from dmc_cli.runtime.device import select_device
from dmc_cli.settings import SurfaceSettings
from dmc_cli.volume.volume import Volume


@dataclass
class Between:
    """Steps from the edges' middles and triangles: at first, after smoothing, and at the end; the states."""

    first: np.ndarray
    smooth: np.ndarray
    last: np.ndarray
    first_faces: np.ndarray
    faces: np.ndarray
    states: np.ndarray
    crossing: np.ndarray


def stages_of(device: str, volume: Volume, settings: SurfaceSettings) -> Between:
    """What the stages make of a volume on a device."""
    uploaded = upload_volume(volume, select_device(device, 1))
    stages = find_edges(uploaded, settings, None, False, serves_special=True)
    moves = Moves(stages, stages.place_vertices(), volume.affine)
    count = stages.ranks.vertex_count

    def copied() -> tuple[np.ndarray, np.ndarray]:
        stages.device.finish()
        wp.synchronize()
        return moves.steps.step.numpy()[:count].copy(), moves.faces.numpy().copy()

    moves.settle()
    first, first_faces = copied()
    moves.smooth()
    smooth, _ = copied()
    moves.guard()
    last, faces = copied()
    states, crossing = moves.steps.state.numpy().copy(), moves.steps.crossing.numpy()[:count].copy()
    return Between(first, smooth, last, first_faces, faces, states, crossing)
