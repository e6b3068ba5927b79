"""Make nets and meshes of labels from arrays, and judge them by NumPy alone."""

import numpy as np
import warp as wp

from dmc_cli.app.label_surfaces import list_shells, make_label_mesh
from dmc_cli.contouring import extract_net, extract_shells
from dmc_cli.field import grid_of
from dmc_cli.progress import SILENT, Stopwatch
from dmc_cli.runtime import select_device
from dmc_cli.volume import Volume, encode_labels, find_labels


def volume_of_labels(labels, spacing=(1.0, 1.0, 1.0)):
    return Volume(values=labels, affine=np.diag([*spacing, 1.0]), space="none")


def net_of(labels, threads=2):
    """The net of an array of labels [k, j, i] and its shells."""
    volume = volume_of_labels(labels)
    codes = encode_labels(volume, find_labels(volume).stored)
    device = select_device("cpu", threads)
    net = extract_net(wp.array(codes, dtype=wp.uint16, device="cpu"), grid_of(volume.shape, 1), device)
    return net, extract_shells(net)


def mesh_of(labels, spacing=(1.0, 1.0, 1.0), threads=2):
    """The smooth mesh of an array of labels [k, j, i]."""
    volume = volume_of_labels(labels, spacing)
    stored = find_labels(volume).stored
    device = select_device("cpu", threads)
    return make_label_mesh(volume, stored, volume.affine, device, Stopwatch(SILENT))


def shells_of(mesh):
    return list(list_shells(mesh, int(mesh.shell_face_codes.max(initial=0))))


def brute_force_quads(labels):
    """The crossed grid edges, a row each: node i, j, k, axis, larger and smaller code, in a padded grid."""
    codes = np.pad(np.unique(labels, return_inverse=True)[1].reshape(labels.shape), 1)
    if 0 not in labels:
        codes[1:-1, 1:-1, 1:-1] += 1
    rows = []
    for axis in range(3):
        after = np.roll(codes, -1, axis=2 - axis)
        for k, j, i in np.argwhere(codes != after):
            pair = sorted((codes[k, j, i], after[k, j, i]), reverse=True)
            rows.append((i, j, k, axis, *pair))
    return np.array(sorted(rows), dtype=int).reshape(-1, 6)


def assert_closed_manifold(faces, count):
    """Each directed side once, with its opposite; the quads of each vertex in one fan."""
    assert np.array_equal(np.unique(faces), np.arange(count))
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2).astype(np.int64)
    key, opposite = sides @ [count, 1], sides @ [1, count]
    order = np.argsort(key)
    assert (np.diff(key[order]) > 0).all(), "a side is there twice"
    place = np.minimum(np.searchsorted(key[order], opposite), len(key) - 1)
    twin = order[place]
    assert (key[twin] == opposite).all(), "a side has no opposite"
    turned = twin[np.arange(len(key)).reshape(-1, 4)[:, [3, 0, 1, 2]].ravel()]
    lowest, at = np.arange(len(key)), turned
    for _ in range(int(np.bincount(faces.ravel()).max(initial=0))):
        lowest, at = np.minimum(lowest, at), turned[at]
    assert len(np.unique(lowest)) == count, "quads of a vertex in several fans"


def enclosed(shell):
    """The volume inside bilinear patches: the mean over both ways of splitting the quads."""
    a, b, c, d = (shell.points[shell.faces[:, n]].astype(float) for n in range(4))
    tetrahedra = ((a, b, c), (a, c, d), (a, b, d), (b, c, d))
    return sum(np.einsum("qi,qi->", x, np.cross(y, z)) for x, y, z in tetrahedra) / 12


def ball(radius, seed, spacing=(1.0, 1.0, 1.0)):
    """A ball in a random position, radius in x, as labels [k, j, i], and its centre."""
    rng = np.random.default_rng(seed)
    count = [int(2 * (radius + 3) / step) + 3 for step in spacing]
    centre = np.array([(n // 2 + rng.random()) * step for n, step in zip(count, spacing, strict=True)])
    k, j, i = np.meshgrid(*[np.arange(n) for n in count[::-1]], indexing="ij")
    away = [n * step - c for n, step, c in zip((i, j, k), spacing, centre, strict=True)]
    return (sum(x * x for x in away) < radius**2).astype(np.uint8), centre


def normals_error(shell, centre):
    """The RMS angle in degrees between the quads' normals and those of a ball round a centre."""
    p = shell.points[shell.faces].astype(float)
    normal = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
    away = p.mean(axis=1) - centre
    cosine = (
        np.einsum("qi,qi->q", normal, away) / np.linalg.norm(normal, axis=1) / np.linalg.norm(away, axis=1)
    )
    return float(np.sqrt(np.mean(np.degrees(np.arccos(np.clip(cosine, -1, 1))) ** 2)))


def least_jacobian(points, faces):
    """The least scaled Jacobian of quads, against their own normals."""
    p = points[faces].astype(float)
    normal = np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
    u, v = np.roll(p, -1, axis=1) - p, np.roll(p, 1, axis=1) - p
    sine = np.einsum("qci,qi->qc", np.cross(u, v), normal)
    lengths = np.linalg.norm(u, axis=2) * np.linalg.norm(v, axis=2) * np.linalg.norm(normal, axis=1)[:, None]
    return float((sine / lengths).min())
