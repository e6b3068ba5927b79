"""A hundred runs of `dmc convert` and the hashes of what they write.

`python -m tests.same_bytes` writes the hashes down anew; `git diff` then shows which runs changed.
"""

import hashlib
import json
import tempfile
import zipfile
from pathlib import Path

import numpy as np

from tests.volume_io.dicom.scanner import make_slice, save

ROOT = Path(__file__).resolve().parent.parent
HASHES = ROOT / "tests" / "data" / "same_bytes.json"

RAW = "sample_data/raw/trabecular_crop_128x128x128_uint8.raw"
RAW_OPTIONS = "--shape 128,128,128 --dtype uint8"
TOOTH = "sample_data/nrrd/tooth.nrrd"
HEAD = "sample_data/metaimage/head_mr_small.mha"

TRIANGLES = ("mc", "tmc")

OTHER_SUFFIXES = [
    "stl",
    "vtp",
    "vtu",
    "vtk",
    "glb",
    "msh",
    "inp",
    "nas",
    "k",
    "mesh",
    "xdmf",
    "gii",
    "pial",
    "usda",
]
"""Formats on a small volume; the bytes of 3MF follow the version of zlib."""

RUNS = [
    # what is there by default, from each kind of file
    f"{TOOTH} a.ply -i 500",
    f"{HEAD} a.ply -i 30",
    "sample_data/metaimage/head_mr_turned.mhd a.ply -i 30",
    "sample_data/nifti/head_mr.nii.gz a.ply -i 60",
    "sample_data/nifti/fistula_mra.nii.gz a.ply -i 100",
    "sample_data/nrrd/fistula_mra.nrrd a.ply -i 100",
    "sample_data/dicom/head_ct a.ply -i 300",
    f"{RAW} a.ply -i 85 {RAW_OPTIONS}",
    "uneven a.ply -i 150",
    "synth:genus_two:40 a.ply -i 0",
    "synth:kummer:40 a.ply -i 0",
    "synth:steiner:40 a.ply -i 0",
    "synth:sphere:40 a.ply -i 0",
    "synth:torus:40 a.ply -i 0",
    "synth:noise:24 a.ply -i 0.5",
    # values of every type, with slope and without data
    *[f"{name}.npy a.ply -i {level}" for name, level in [("int8", 3), ("uint8", 100), ("int16", -200)]],
    *[f"{name}.npy a.ply -i {level}" for name, level in [("uint16", 900), ("int32", 7), ("uint32", 4e9)]],
    *[f"{name}.npy a.ply -i {level}" for name, level in [("int64", 7), ("float32", 0), ("float64", 0)]],
    "holes.npy a.ply -i 0",
    "holes.npy a.ply -i 0 --border closed --inside below",
    "flat.npy a.ply -i 0",
    "thin.npy a.ply -i 0 --border closed",
    # which surface
    *[f"synth:noise:20 a.ply -i 0.3 --border {border}" for border in ("open", "closed")],
    *[f"synth:noise:20 a.ply -i 0.3 --topology asymptotic --border {b}" for b in ("open", "closed")],
    f"{HEAD} a.ply -i 30 --inside below",
    f"{HEAD} a.ply -i 30 --orientation gradient --border closed",
    *[f"{HEAD} a.ply -i 30 --placement {placement}" for placement in ("sampled", "iterative", "centroid")],
    *[f"synth:noise:20 a.ply -i 0.3 --placement {p}" for p in ("sampled", "iterative", "centroid")],
    # other methods
    *[f"{HEAD} a.ply -i 30 --method {method} --border closed" for method in ("nets", "dc")],
    f"{HEAD} a.ply -i 30 --method nets --inside below --orientation gradient",
    f"{HEAD} a.ply -i 30 --method dc --placement paper",
    f"{HEAD} a.ply -i 30 --method dc --placement particle --steps 20 --step-size 0.1",
    *[f"holes.npy a.ply -i 0 --method {method}" for method in ("nets", "dc")],
    *[f"{name}.npy a.ply -i {level} --method dc" for name, level in [("uint8", 100), ("int32", 7)]],
    "uneven a.ply -i 150 --method dc --simplify all",
    *[f"synth:noise:20 a.ply -i 0.3 --method {m} --halfedges h.npz" for m in ("nets", "dc")],
    *[f"{HEAD} a.ply -i 30 --method macet --border {border} --inside below" for border in ("open", "closed")],
    f"{HEAD} a.ply -i 30 --method macet --orientation gradient",
    "holes.npy a.ply -i 0 --method macet --halfedges h.npz",
    *[f"{name}.npy a.ply -i {level} --method macet" for name, level in [("uint8", 100), ("float64", 0)]],
    "uneven a.ply -i 150 --method macet",
    *[f"synth:noise:20 a.ply -i 0.3 --method macet --threads {threads}" for threads in (1, 3)],
    # triangles
    *[f"{HEAD} a.ply -i 30 --method {method} --border closed" for method in TRIANGLES],
    f"{HEAD} a.ply -i 30 --method mc --triangulation standard --inside below --orientation gradient",
    *[f"synth:noise:20 a.ply -i 0.3 --method {m} --halfedges h.npz --threads 3" for m in TRIANGLES],
    "synth:noise:16 a.obj -i 0.3 --method tmc --halfedges h.txt --threads 1",
    "synth:noise:16 a.off -i 0.3 --method tmc --triangulation standard --inside below",
    *[f"holes.npy a.ply -i 0 --method {method}" for method in TRIANGLES],
    *[f"holes.npy a.ply -i 0 --method {m} --border closed --inside below" for m in TRIANGLES],
    *[f"{name}.npy a.ply -i {level} --method tmc" for name, level in [("uint8", 100), ("int32", 7)]],
    *[f"uneven a.ply -i 150 --method {method}" for method in TRIANGLES],
    "uneven a.ply -i 150 --method mc --space voxel",
    # what becomes of it
    *[f"{HEAD} a.ply -i 30 --simplify {pattern}" for pattern in ("3x3y", "3333", "all")],
    f"{HEAD} a.ply -i 30 --simplify all --no-project",
    f"{HEAD} a.ply -i 30 --simplify all --simplify-rules paper --border closed",
    f"{HEAD} a.ply -i 30 --remesh 6 --border closed",
    "synth:genus_two:40 a.ply -i 0 --remesh 12",
    "synth:noise:20 a.ply -i 0.3 --remesh 3",
    f"{HEAD} a.ply -i 30 --relax 4",
    "synth:torus:40 a.ply -i 0 --simplify all --relax 3",
    "uneven a.ply -i 150 --simplify all --relax 2",
    "holes.npy a.ply -i 0 --simplify all --relax 2",
    # formats
    *[f"{HEAD} a.{suffix} -i 30" for suffix in ("obj", "off")],
    *[f"synth:noise:16 a.{suffix} -i 0.3" for suffix in OTHER_SUFFIXES],
    *[f"synth:noise:16 a.{suffix} -i 0.3 --ascii" for suffix in ("stl", "vtp", "msh", "gii")],
    f"{HEAD} a.ply -i 30 --ascii",
    f"{HEAD} a.ply -i 30 --no-normals",
    f"{HEAD} a.obj -i 30 --no-normals --simplify all",
    f"{HEAD} a.ply -i 30 --halfedges h.npz",
    f"{HEAD} a.ply -i 30 --halfedges h.txt --simplify all",
    "synth:noise:16 a.off -i 0.3 --halfedges h.npz --remesh 2",
    # spaces
    *[f"sample_data/metaimage/head_mr_turned.mhd a.ply -i 30 --space {s}" for s in ("ras", "lps", "voxel")],
    "uneven a.ply -i 150 --space voxel",
    f"{RAW} a.ply -i 85 {RAW_OPTIONS} --spacing 0.5,0.25,2 --origin -3,7,11",
    # threads
    *[f"{TOOTH} a.ply -i 500 --threads {threads} --simplify all" for threads in (1, 2, 3)],
    "synth:noise:24 a.ply -i 0.5 --threads 3 --remesh 2 --halfedges h.npz",
]


def make_volumes(folder: Path) -> None:
    """Write the volumes that the runs name but the project does not hold, made of whole numbers only."""
    k, j, i = np.indices((18, 21, 26)) - np.array([9, 10, 12]).reshape(3, 1, 1, 1)
    ball = 60 - (k * k + j * j + i * i) + 5 * (i * j % 7) - 3 * (k * i % 5)
    types = ("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "float32", "float64")
    for dtype, offset in zip(types, (0, 128, -200, 900, 0, 4_000_000_000, 0, 0, 0), strict=True):
        limits = np.iinfo(dtype) if np.dtype(dtype).kind in "iu" else None
        values = ball + offset if limits is None else np.clip(ball + offset, limits.min, limits.max)
        np.save(folder / f"{dtype}.npy", values.astype(dtype))
    holes = ball.astype(np.float32) / 4
    holes[ball % 11 == 0] = np.nan
    np.save(folder / "holes.npy", holes)
    np.save(folder / "flat.npy", ball[8:10].astype(np.int16))
    np.save(folder / "thin.npy", np.ascontiguousarray(ball[:, :, 11:13]).astype(np.float32))
    (folder / "uneven").mkdir()
    scan = (150 + 2 * ball).astype("<i2")
    for number, depth in enumerate(np.cumsum(1 + np.arange(len(scan)) % 3 * 0.25)):
        part = make_slice((-20.0, 5.0, depth), number, values=scan[number], RescaleIntercept="0")
        save(part, folder / "uneven" / f"{number:02}.dcm")


def written_by(run, command: str, folder: Path) -> dict[str, str]:
    """Run `dmc convert` with the words of a command; return the hashes of its outputs by their names.

    `run` calls `dmc` with words and returns a result with its exit status and output.
    """
    with tempfile.TemporaryDirectory() as target:
        result = run("convert", *_words(command, folder, Path(target)), "--device", "cpu", "--quiet")
        assert result.exit_code == 0, f"{command}: {result.output}"
        outputs = sorted(Path(target).iterdir())
        return {path.name: _hash(path) for path in outputs}


def _hash(path: Path) -> str:
    """Return the hash of a file, of an archive that of its members: headers depend on Python's version."""
    if path.suffix != ".npz":
        return hashlib.sha256(path.read_bytes()).hexdigest()
    with zipfile.ZipFile(path) as archive:
        members = [name.encode() + archive.read(name) for name in archive.namelist()]
    return hashlib.sha256(b"".join(members)).hexdigest()


def _words(command: str, folder: Path, target: Path) -> list[object]:
    """Return the words of a command: outputs in `target`, volumes in `folder` or in the project."""
    made = {path.name for path in folder.iterdir()}
    words: list[object] = []
    for word in command.split():
        if word in made:
            words.append(folder / word)
        elif word.startswith("sample_data/"):
            words.append(ROOT / word)
        else:
            words.append(target / word if word[:2] in ("a.", "h.") else word)
    return words


def main() -> None:
    """Write the hashes of all runs down."""
    from click.testing import CliRunner

    from dmc_cli.cli import dmc

    with tempfile.TemporaryDirectory() as folder:
        make_volumes(Path(folder))
        hashes = {
            command: written_by(
                lambda *words: CliRunner().invoke(dmc, [str(w) for w in words]), command, Path(folder)
            )
            for command in RUNS
        }
    HASHES.write_text(json.dumps(hashes, indent=1) + "\n")


if __name__ == "__main__":
    main()
