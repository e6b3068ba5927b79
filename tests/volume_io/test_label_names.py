"""Labels have the names and colours of files and tables, and segments that overlap all come out."""

import json

import nibabel
import nrrd
import numpy as np
import pytest

from dmc_cli.volume import Label
from tests.cli.test_labels import enclosed, three_boxes
from tests.volume_io.dicom.scanner import save
from tests.volume_io.dicom.test_segments import segmentation

CARET = """<?xml version="1.0" encoding="UTF-8"?>
<CaretExtension><VolumeInformation Index="0"><LabelTable>
<Label Key="0" Red="0" Green="0" Blue="0" Alpha="0"><![CDATA[background]]></Label>
<Label Key="1" Red="1.0" Green="0.5" Blue="0" Alpha="1"><![CDATA[spleen]]></Label>
<Label Key="2" Red="0" Green="0" Blue="1" Alpha="1">left &amp; right kidney</Label>
</LabelTable></VolumeInformation></CaretExtension>"""
"""As Caret, and after it TotalSegmentator, write it: names literal, or as text."""

SNAP = """################################################
# ITK-SnAP Label Description File
    0     0    0    0        0  0  0    "Clear Label"
    1   255    0    0        1  1  1    "left lung"
   40     0  128  255      0.5  1  1    "liver"
"""

FREESURFER = """#$Id: FreeSurferColorLUT.txt
#No. Label Name:                            R   G   B   A
0   Unknown                                 0   0   0   0
1   Left-Cerebral-Exterior                  70  130 180 0
2   Left-Cerebral-White-Matter              245 245 245 0
"""

BIDS = "index\tname\tabbreviation\tcolor\n1\tGrey Matter\tGM\t#ff53bb\n2\tWhite Matter\tWM\t#2f8bbf\n"


def row_names(run, tmp_path, source, *words):
    """The number, name and colour of each label in the report."""
    report = tmp_path / "r.json"
    result = run(
        "convert", source, tmp_path / "o" / "{label}.ply", "--report", report, "--dry-run", "--force", *words
    )
    assert result.exit_code == 0, result.stderr
    rows = json.loads(report.read_text())["labels"]
    return [(row["label"], row["name"], row["color"]) for row in rows]


@pytest.fixture
def nifti(tmp_path):
    """A NIfTI file of the boxes, with no word about them."""
    path = tmp_path / "sub-01_dseg.nii.gz"
    nibabel.Nifti1Image(three_boxes().T, np.eye(4)).to_filename(path)
    return path


def test_a_file_without_names(run, tmp_path, nifti):
    assert row_names(run, tmp_path, nifti, "--labels", "all") == [
        (1, "label_1", None),
        (2, "label_2", None),
        (40, "label_40", None),
    ]


@pytest.mark.parametrize("code", [0, 30])
@pytest.mark.parametrize("kind", [nibabel.Nifti1Image, nibabel.Nifti2Image])
def test_an_extension_of_nifti(run, tmp_path, kind, code):
    image = kind(three_boxes().T, np.eye(4))
    image.header.extensions.append(nibabel.nifti1.Nifti1Extension(code, CARET.encode()))
    image.to_filename(tmp_path / "a.nii.gz")
    assert row_names(run, tmp_path, tmp_path / "a.nii.gz", "--labels", "all") == [
        (1, "spleen", [255, 128, 0]),
        (2, "left & right kidney", [0, 0, 255]),
        (40, "label_40", None),
    ]
    assert row_names(run, tmp_path, tmp_path / "a.nii.gz", "--labels", "Spleen,40")[0][1] == "spleen"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (SNAP, [(1, "left lung", [255, 0, 0]), (2, "label_2", None), (40, "liver", [0, 128, 255])]),
        (
            FREESURFER,
            [
                (1, "Left-Cerebral-Exterior", [70, 130, 180]),
                (2, "Left-Cerebral-White-Matter", [245, 245, 245]),
                (40, "label_40", None),
            ],
        ),
        (
            BIDS,
            [(1, "Grey Matter", [255, 83, 187]), (2, "White Matter", [47, 139, 191]), (40, "label_40", None)],
        ),
    ],
    ids=["ITK-SNAP", "FreeSurfer", "BIDS"],
)
def test_tables(run, tmp_path, nifti, text, expected):
    (tmp_path / "names.txt").write_text(text)
    words = ["--labels", "all", "--label-names", tmp_path / "names.txt"]
    assert row_names(run, tmp_path, nifti, *words) == expected


@pytest.mark.parametrize("name", ["sub-01_dseg.tsv", "dseg.tsv"])
def test_the_table_beside_a_segmentation(run, tmp_path, nifti, name):
    (tmp_path / name).write_text(BIDS)
    assert row_names(run, tmp_path, nifti, "--labels", "white matter") == [
        (2, "White Matter", [47, 139, 191])
    ]


def test_names_go_into_files_and_groups_safely(run, tmp_path, nifti):
    (tmp_path / "names.tsv").write_text("index\tname\n1\t../up & away\n2\tliver\n40\tliver\n")
    words = ["--labels", "all", "--label-names", tmp_path / "names.tsv"]
    assert run("convert", nifti, tmp_path / "o" / "{name}_{label}.ply", *words).exit_code == 0
    assert sorted(path.name for path in (tmp_path / "o").iterdir()) == [
        "liver_2.ply",
        "liver_40.ply",
        "up_away_1.ply",
    ]
    clash = run("convert", nifti, tmp_path / "p" / "{name}.ply", *words)
    assert clash.exit_code == 2
    assert "would be the file of label 2 and of label 40" in clash.stderr
    assert run("convert", nifti, tmp_path / "a.obj", *words).exit_code == 0
    groups = [line for line in (tmp_path / "a.obj").read_text().splitlines() if line.startswith("g ")]
    assert groups == ["g up_away", "g liver_2", "g liver_40"]


def test_a_table_that_is_none_is_refused(run, tmp_path, nifti):
    (tmp_path / "names.txt").write_text("spleen, liver\n")
    for name, message in (("names.txt", "names no labels; expected a table"), ("gone.txt", "cannot be read")):
        words = ["--labels", "all", "--label-names", tmp_path / name]
        result = run("convert", nifti, tmp_path / "{label}.ply", *words)
        assert result.exit_code == 3
        assert message in result.stderr


def slicer_file(path, layers, segments):
    """A segmentation of 3D Slicer: layers [n, k, j, i] or one [k, j, i], and a dict of pairs a segment."""
    header = {"space": "left-posterior-superior", "space origin": [0, 0, 0]}
    directions = np.eye(3)
    if layers.ndim == 4:
        header |= {"kinds": ["list", "domain", "domain", "domain"]}
        directions = np.vstack([np.full(3, np.nan), directions])
    for number, pairs in enumerate(segments):
        header |= {f"Segment{number}_{key}": str(value) for key, value in pairs.items()}
    data = np.moveaxis(layers, 0, -1).transpose(3, 2, 1, 0) if layers.ndim == 4 else layers.T
    nrrd.write(str(path), data, header | {"space directions": directions})
    return path


def segment(name, value, layer=0, color="1 0.5 0"):
    return {"ID": f"id_{name}", "Name": name, "LabelValue": value, "Layer": layer, "Color": color}


def test_segments_of_slicer(run, tmp_path):
    segments = [segment("bone", 1), segment("gone", 3), segment("fat", 2, color="0 0 1")]
    path = slicer_file(tmp_path / "a.seg.nrrd", three_boxes(), segments)
    report = tmp_path / "r.json"
    result = run("convert", path, tmp_path / "{name}.ply", "--labels", "all", "--report", report)
    assert result.exit_code == 0, result.stderr
    assert sorted(each.name for each in tmp_path.glob("*.ply")) == ["bone.ply", "fat.ply", "label_40.ply"]
    found = json.loads(report.read_text())
    assert [(row["name"], row["color"]) for row in found["labels"]][:2] == [
        ("bone", [255, 128, 0]),
        ("fat", [0, 0, 255]),
    ]
    assert found["warning_codes"][-1] == "W-LABELS-ABSENT"
    assert "no node has: 3 gone" in found["warnings"][-1]
    assert "one of 1 bone, 2 fat, 40" in " ".join(
        run("convert", path, tmp_path / "{label}.ply", "--labels", "skin").stderr.split()
    )


def test_segments_that_overlap_all_come_out_whole(run, tmp_path):
    whole = np.zeros((12, 14, 16), np.uint8)
    whole[2:10, 2:10, 2:12] = 1
    inner = np.zeros_like(whole)
    inner[4:8, 4:8, 4:8], inner[4:8, 4:8, 8:14] = 1, 2
    segments = [segment("skull", 1), segment("tumour", 1, 1), segment("edema", 2, 1)]
    path = slicer_file(tmp_path / "a.seg.nrrd", np.stack([whole, inner]), segments)
    from dmc_cli.mesh_io import read_mesh

    result = run("convert", path, tmp_path / "{name}_{label}.ply", "--labels", "all")
    assert result.exit_code == 0, result.stderr
    expected = {"skull_1": whole == 1, "tumour_2": inner == 1, "edema_3": inner == 2}
    assert sorted(each.stem for each in tmp_path.glob("*.ply")) == sorted(expected)
    for name, mask in expected.items():
        assert enclosed(read_mesh(str(tmp_path / f"{name}.ply"))) == pytest.approx(mask.sum(), rel=0.01)
    refused = run("convert", path, tmp_path / "all.ply", "--conforming")
    assert refused.exit_code == 2
    assert "lie in 2 layers, and may overlap: 1; 2, 3" in " ".join(refused.stderr.split())
    of_one = run("convert", path, tmp_path / "one.ply", "--conforming", "--labels", "tumour,edema")
    assert of_one.exit_code == 0, of_one.stderr
    chosen = run("convert", path, tmp_path / "second.obj", "--labels", "all", "--volume-index", "1")
    assert chosen.exit_code == 0, chosen.stderr
    assert "label     2 tumour: 64 nodes" in chosen.stderr


def test_segments_of_dicom(run, tmp_path):
    masks = np.zeros((8, 9, 11), np.uint8)
    masks[:4, 2:6, 2:7] = 1
    masks[4:, 4:8, 4:9] = 1
    planes = [(1, 0), (1, 2), (1, 4), (1, 6), (7, 2), (7, 4), (7, 6), (7, 8)]
    dataset = segmentation(planes, masks)
    dataset.SegmentSequence[1].RecommendedDisplayCIELabValue = [
        34885,
        53485,
        50171,
    ]  # red
    (tmp_path / "d").mkdir()
    source = save(dataset, tmp_path / "d" / "a")
    assert row_names(run, tmp_path, source, "--labels", "all") == [
        (1, "part 1", None),
        (7, "part 7", [255, 0, 0]),
    ]
    result = run("convert", source, tmp_path / "{label}.ply", "--labels", "part 7")
    assert result.exit_code == 0, result.stderr
    assert "label     7 part 7: 80 nodes" in result.stderr


def test_a_label_map_of_dicom(run, tmp_path):
    masks = np.zeros((4, 9, 11), np.uint8)
    masks[:, 2:6, 2:5], masks[:, 2:6, 5:9] = 1, 2
    dataset = segmentation([(1, 0), (2, 2), (1, 4), (2, 6)], masks, "LABELMAP")
    source = save(dataset, tmp_path / "a")
    assert [row[:2] for row in row_names(run, tmp_path, source, "--labels", "all")] == [
        (1, "part 1"),
        (2, "part 2"),
    ]


def test_a_table_names_the_segments_of_a_file_anew(run, tmp_path):
    path = slicer_file(tmp_path / "a.seg.nrrd", three_boxes(), [segment("x", 1), segment("y", 2)])
    (tmp_path / "names.tsv").write_text("index\tname\n1\tbone\n")
    names = row_names(run, tmp_path, path, "--labels", "all", "--label-names", tmp_path / "names.tsv")
    assert [name for _, name, _ in names] == ["bone", "y", "label_40"]
    assert Label(value=1, number=1).name == ""
