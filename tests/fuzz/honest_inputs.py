"""Honest inputs that have to be unpacked: packed files, parts of pairs and slices, zips, tars."""

import bz2
import gzip
import io
import lzma
import tarfile
import zipfile

import nibabel as nib
import numpy as np

from tests.volume_io.afni_files import afni_header
from tests.volume_io.dicom.scanner import axial, make_slice, save
from tests.volume_io.par_files import par_header

VALUES = np.arange(6 * 7 * 8, dtype="<i2").reshape(6, 7, 8)

NRRD = (
    "NRRD0005\n# comment\ntype: short\ndimension: 3\nsizes: 8 7 6\nencoding: raw\nendian: little\n"
    "space: left-posterior-superior\nspace directions: (2,0,0) (0,3,0) (0,0,4)\nspace origin: (7,8,9)\n{}\n"
)

PACKERS = {".gz": gzip.compress, ".bz2": bz2.compress, ".xz": lzma.compress}


def packed(path, suffix):
    """Pack a file; it is gone then."""
    whole = path.with_name(path.name + suffix)
    whole.write_bytes(PACKERS[suffix](path.read_bytes()))
    path.unlink()
    return whole


def make_packed(folder):
    content = NRRD.format("").encode() + VALUES.tobytes()
    for suffix, pack in PACKERS.items():
        (folder / f"a.nrrd{suffix}").write_bytes(pack(content))
    with zipfile.ZipFile(folder / "other.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("scan/raw.nrrd", content)
        archive.writestr("scan/readme.txt", "of use to people")
    return [folder / name for name in ("a.nrrd.gz", "a.nrrd.bz2", "a.nrrd.xz", "other.zip")]


def make_packed_pairs(folder):
    """Pairs and detached headers; every part is damaged."""
    nib.save(nib.Spm2AnalyzeImage(VALUES.T, np.diag([2, 3, 4, 1])), folder / "a.img")
    nib.save(nib.Nifti1Pair(VALUES.T, np.diag([2, 3, 4, 1])), folder / "n.img")
    (folder / "a+orig.HEAD").write_text(afni_header(VALUES.shape[::-1]))
    (folder / "a+orig.BRIK").write_bytes(VALUES.tobytes())
    (folder / "p.PAR").write_text(par_header((8, 7, 6), [[[1, 0]] * 6]))
    (folder / "p.REC").write_bytes(VALUES.tobytes())
    (folder / "d.nhdr").write_text(NRRD.format("data file: d.raw.bz2\n"))
    (folder / "d.raw").write_bytes(VALUES.tobytes())
    (folder / "m.mhd").write_text(
        "NDims = 3\nDimSize = 8 7 6\nElementType = MET_SHORT\nElementSpacing = 1 2 3\n"
        "ElementDataFile = m.raw.xz\n"
    )
    (folder / "m.raw").write_bytes(VALUES.tobytes())
    suffixes = {
        **{"a.img": ".xz", "n.hdr": ".gz", "n.img": ".bz2", "a+orig.HEAD": ".gz", "a+orig.BRIK": ".bz2"},
        **{"p.PAR": ".bz2", "p.REC": ".gz", "d.nhdr": ".gz", "d.raw": ".bz2", "m.raw": ".xz"},
    }
    return [
        folder / "a.hdr",
        folder / "m.mhd",
        *(packed(folder / name, how) for name, how in suffixes.items()),
    ]


def make_packed_slices(folder):
    paths = []
    for suffix in PACKERS:
        for k, position in enumerate(axial(3)):
            path = packed(save(make_slice(position, k), folder / suffix[1:] / f"{k}.dcm"), suffix)
        paths.append(path)
    return paths


def make_zip(folder):
    with zipfile.ZipFile(folder / "a.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for k, position in enumerate(axial(3)):
            archive.write(save(make_slice(position, k), folder / "in" / f"{k}"), f"{k}")
    return [folder / "a.zip"]


def make_tar(folder):
    """A tar of each kind, plain and packed, and one of DICOM."""
    content = NRRD.format("").encode() + VALUES.tobytes()
    paths = []
    kinds = {"u.tar": tarfile.USTAR_FORMAT, "g.tar": tarfile.GNU_FORMAT, "p.tar": tarfile.PAX_FORMAT}
    for name, kind in {**kinds, "z.tgz": tarfile.PAX_FORMAT}.items():
        paths.append(folder / name)
        with tarfile.open(paths[-1], "w:gz" if name == "z.tgz" else "w", format=kind) as archive:
            for inner, data in {
                "scan " * (5 if kind == kinds["u.tar"] else 50) + "/a.nrrd": content,
                "a.txt": b"x",
            }.items():
                entry = tarfile.TarInfo(inner)
                entry.size = len(data)
                archive.addfile(entry, io.BytesIO(data))
    paths.append(folder / "d.tar")
    with tarfile.open(paths[-1], "w") as archive:
        for k, position in enumerate(axial(3)):
            archive.add(save(make_slice(position, k), folder / "in" / f"{k}"), f"{k}")
    return paths
