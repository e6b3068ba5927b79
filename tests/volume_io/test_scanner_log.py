"""Distances of nodes from the text that a scanner left beside its slices: read where they are sure."""

import numpy as np
import pytest

from dmc_cli.errors import AmbiguousVolumeError
from tests.cases import case
from tests.volume_io.reading import counting, read

PIL = pytest.importorskip("PIL.Image")

VALUES = counting((4, 6, 7), "u1")

NRECON = """[System]
Scanner=Skyscan1172
[Acquisition]
Camera Pixel Size (um)=   11.40
Image Pixel Size (um)=   9.98
[Reconstruction]
Section to Section Step={step}
Sections Count={count}
Result Image Width (pixels)={width}
Result Image Height (pixels)=6
Pixel Size (um)={size}
"""


def nrecon(step=1, count=4, width=7, size="17.50"):
    return NRECON.format(step=step, count=count, width=width, size=size)


PHOENIX = """[Geometry]
FDD=815.23
VoxelSizeX=0.015
VoxelSizeY=0.015
[Detector]
PixelsizeX=0.2
PixelsizeY=0.2
"""

NIKON = """[XTekCT]
VoxelsX={x}
VoxelSizeX=0.04
VoxelsY=6
VoxelSizeY=0.05
VoxelsZ={z}
VoxelSizeZ=0.06
DetectorPixelSizeX=0.2
"""

VGI = """{{volume1}}
[representation]
size = {x} 6 4
bitsperelement = 8
[geometry]
resolution = 0.5 0.5 0.7
unit = mm
"""


def stack(folder, texts=(), step=1, first=100):
    for k, plane in enumerate(VALUES):
        PIL.fromarray(plane).save(folder / f"scan_rec{first + k * step:08d}.png")
    for name, text in dict(texts).items():
        (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return folder


def codes(volume):
    return [notice.code for notice in volume.warnings]


@pytest.mark.parametrize(
    ("name", "text", "spacing"),
    [
        ("scan_rec.log", nrecon(), (0.0175,) * 3),
        ("scan_rec.log", nrecon().replace("\n", "\r\n"), (0.0175,) * 3),
        ("scan_rec.log", "[Reconstruction]\nPixel Size (um)=17.50\n", (0.0175,) * 3),
        ("scan.txt", "Pixel Size (µm)\t: 5.25\n", (0.00525,) * 3),
        ("scan.txt", "Pixel Size (µm)\t: 5.25\n".encode("latin-1"), (0.00525,) * 3),
        ("scan.txt", "Voxel size = 5.25 nm\n".encode("utf-16"), (5.25e-6,) * 3),
        ("scan.txt", "Voxel size: 10.5 x 10.5 x 12 um\n", (0.0105, 0.0105, 0.012)),
        ("scan.txt", "Image width: 7\nPixel size (mm): 0.5\nSlice increment (mm): 2\n", (0.5, 0.5, 2)),
        ("scan.txt", "el_size_mm: 0.0607 0.0607 0.0610\n", (0.0607, 0.0607, 0.061)),
        ("scan.txt", "Element Size [mm]   0.018 0.018 0.02\n", (0.018, 0.018, 0.02)),
        (
            "scan.txt",
            "! header\nOrig-ISQ-Dim-p        70   60   40\nOrig-ISQ-Dim-um       1400  1200  1200\n",
            (0.02, 0.02, 0.03),
        ),
        ("scan.xtekct", "[XTekCT]\nVoxelSizeX=0.04\nVoxelSizeY=0.05\nVoxelSizeZ=0.06\n", (0.04, 0.05, 0.06)),
        ("scan.pca", "[Geometry]\nVoxelSizeX=0.02\nVoxelSizeY=0.02\nVoxelSizeZ=0.02\n", (0.02,) * 3),
        ("scan.pca", "[Geometry]\nVoxelSizeX=0.02\nVoxelSizeY=0.02\n", (0.02,) * 3),
        ("scan.pcr", "[VolumeData]\nVoxelSizeRec=0.0125\nVolume_SizeX=7\n", (0.0125,) * 3),
        ("scan.vgi", "{volume1}\n[geometry]\nresolution = 0.5 0.5 0.7\nunit = mm\n", (0.5, 0.5, 0.7)),
        ("scan.vgi", "{volume1}\n[geometry]\nresolution = 50 50 70\nunit = um\n", (0.05, 0.05, 0.07)),
        ("scan.txt", "!  El_size_mm (x,y,z)      0.0820  0.0820  0.09\n", (0.082, 0.082, 0.09)),
        ("scan.txt", "Dim-p 70 60 40\nDim-um 1400 1200 1200\n", (0.02, 0.02, 0.03)),
        ("scan.txt", "VoxelSize 0.5 0.5 1.0 mm\n", (0.5, 0.5, 1)),
        (
            "scan.txt",
            "Pixel size x (um): 12\nPixel size y (um): 14\nSlice thickness (um): 20\n",
            (0.012, 0.014, 0.02),
        ),
        ("scan.txt", "Pixel Size: 12 um/pixel\n", (0.012,) * 3),
        ("scan.txt", "Voxel Size [µm/voxel]=12\n", (0.012,) * 3),
        ("scan_rec.log", nrecon().encode("utf-16-le"), (0.0175,) * 3),
        ("scan_rec.log", nrecon().replace(".", ","), (0.0175,) * 3),
        ("scan_rec.log", nrecon(size="17,432").replace(".", ","), (0.017432,) * 3),
        ("scan_rec.log", "Software Version=1.6.10\n" + nrecon().replace(".", ","), (0.0175,) * 3),
        ("scan_rec.log", nrecon(size="17,50"), (0.0175,) * 3),
        ("scan.txt", "Voxel size: 0,5 x 0,5 x 0,7 mm\n", (0.5, 0.5, 0.7)),
        ("scan.txt", "Voxel size (mm): 0.5,0.5,0.7\n", (0.5, 0.5, 0.7)),
        ("scan.txt", "Voxel size (mm): 2,3,4\n", (2, 3, 4)),
        ("scan.log", "Number of Rows=900\nNumber of Columns=7\nImage Pixel Size (um)=6\n", (0.006,) * 3),
        ("scan.pca", PHOENIX, (0.015,) * 3),
        ("scan.txt", "Voxel size: 15 um\n[Camera]\nPixel size: 55 um\n", (0.015,) * 3),
        ("scan.txt", "Dim: 7 6 4\nElement Size: 0.01 0.01 0.012 mm\n", (0.01, 0.01, 0.012)),
        ("scan.xtekct", NIKON.format(x=7, z=4), (0.04, 0.05, 0.06)),
        ("scan.vgi", VGI.format(x=7), (0.5, 0.5, 0.7)),
    ],
)
def test_the_distances_are_read_and_told(tmp_path, name, text, spacing):
    volume = read(stack(tmp_path, {name: text}))
    np.testing.assert_allclose(volume.spacing, spacing, rtol=1e-12)
    assert codes(volume) == ["W-SPACING-FROM-LOG"]
    assert name in volume.warnings[0].sentence
    assert volume.files[-1].name == name
    np.testing.assert_array_equal(volume.values, VALUES)


def test_a_stack_of_tiff_files_has_its_log_too(tmp_path):
    tifffile = pytest.importorskip("tifffile")
    for k, plane in enumerate(VALUES):
        tifffile.imwrite(tmp_path / f"scan_rec{k:08d}.tif", plane)
    (tmp_path / "scan_rec.log").write_text(nrecon())
    volume = read(tmp_path)
    np.testing.assert_allclose(volume.spacing, (0.0175,) * 3)
    assert volume.format == "tiff"


@pytest.mark.parametrize("folder", ["clean", "scan_rec", "scan_spr", "thumbs"])
def test_the_folders_of_the_case_hold_the_same_volume(folder):
    pytest.importorskip("tifffile")
    volume = read(case("tiff_folder_log") / folder)
    np.testing.assert_array_equal(volume.values, read(case("tiff_folder_log") / "clean").values)
    assert volume.shape == (64, 48, 40)
    named = {"scan_spr": "scan_rec_spr.bmp", "thumbs": "Thumbs.db", "scan_rec": "scan_rec.log"}
    sentences = " ".join(notice.sentence for notice in volume.warnings)
    assert named.get(folder, "") in sentences
    assert volume.spacing == pytest.approx((0.0175,) * 3 if folder == "scan_rec" else (1, 1, 1))


@pytest.mark.parametrize(
    ("step", "told", "between"), [(1, 1, 17.5), (2, 2, 35), (2, 1, 35), (1, 4, 70), (4, 4, 70)]
)
def test_slices_lie_as_far_apart_as_their_numbers(tmp_path, step, told, between):
    volume = read(stack(tmp_path, {"scan_rec.log": nrecon(step=told)}, step=step))
    assert volume.spacing == pytest.approx((0.0175, 0.0175, between / 1000))


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("Pixel Size=17.5\n", "W-UNIT-MISSING"),
        ("Pixel Size (parasang)=17.5\n", "W-UNIT-UNKNOWN"),
        ("Pixel Size (um)=0\n", "W-GEOMETRY-CONTRADICTED"),
        ("Pixel Size (um)=1e999\n", "W-GEOMETRY-CONTRADICTED"),
        (nrecon(width=14), "W-GEOMETRY-CONTRADICTED"),
        (nrecon(size="17,432"), "W-GEOMETRY-CONTRADICTED"),
        ("Pixel Size (um)=12 mm\n", "W-GEOMETRY-CONTRADICTED"),
        (nrecon() + nrecon(size=3), "W-GEOMETRY-CONTRADICTED"),
        ("Number of Columns=1000\nImage Pixel Size (um)=6\n", "W-GEOMETRY-CONTRADICTED"),
        ("Dim: 14 12 4\nElement Size: 0.01 0.01 0.012 mm\n", "W-GEOMETRY-CONTRADICTED"),
    ],
)
def test_what_is_not_sure_is_not_used_and_told(tmp_path, text, code):
    volume = read(stack(tmp_path, {"scan_rec.log": text}))
    assert volume.spacing == (1, 1, 1)
    assert codes(volume) == [code, "W-SPACING-MISSING"]
    with pytest.raises(AmbiguousVolumeError, match=code):
        read(tmp_path, strict=True)


@pytest.mark.parametrize(
    ("name", "text", "code"),
    [
        ("scan.xtekct", NIKON.format(x=14, z=4), ["W-GEOMETRY-CONTRADICTED", "W-SPACING-MISSING"]),
        ("scan.xtekct", NIKON.format(x=7, z=8), ["W-SPACING-FROM-LOG", "W-SLICES-COUNT"]),
        ("scan.vgi", VGI.format(x=70), ["W-GEOMETRY-CONTRADICTED", "W-SPACING-MISSING"]),
        ("scan.pcr", "VoxelSizeRec=0.1\nVolume_SizeX=70\n", ["W-GEOMETRY-CONTRADICTED", "W-SPACING-MISSING"]),
        (
            "scan.txt",
            "Pixel size: 200 um\nVoxel size: 15 um\n",
            ["W-SPACING-FROM-LOG", "W-GEOMETRY-CONTRADICTED"],
        ),
        ("scan.txt", "Nominal resolution: 20 um\nVoxel size: 19.7 um\n", ["W-SPACING-FROM-LOG"]),
    ],
)
def test_what_a_text_says_of_the_volume_s_size_or_otherwise_is_told(tmp_path, name, text, code):
    assert codes(read(stack(tmp_path, {name: text}))) == code


def test_the_text_of_slices_that_are_called_otherwise_is_not_used(tmp_path):
    text = "Filename Prefix=other_rec\nPixel Size (um)=12\n"
    volume = read(stack(tmp_path, {"other_rec.log": text}))
    assert volume.spacing == (1, 1, 1)
    assert codes(volume)[:2] == ["W-GEOMETRY-CONTRADICTED", "W-SPACING-MISSING"]
    (tmp_path / "other_rec.log").rename(tmp_path / "scan_rec.log")  # called like the slices, it is theirs
    assert read(tmp_path).spacing == pytest.approx((0.012,) * 3)


def test_what_a_text_says_twice_alike_is_no_contradiction(tmp_path):
    text = nrecon() + "[File name convention]\nFilename Prefix=scan_rec\nPixel Size (mm)=0.0175\n"
    assert read(stack(tmp_path, {"scan_rec.log": text})).spacing == pytest.approx((0.0175,) * 3)


def test_slices_that_the_text_counts_otherwise_are_told(tmp_path):
    volume = read(stack(tmp_path, {"scan_rec.log": nrecon(count=5)}))
    assert volume.spacing == pytest.approx((0.0175,) * 3)
    assert "W-SLICES-COUNT" in codes(volume)


def test_the_given_spacing_is_preferred_and_that_is_told(tmp_path):
    volume = read(stack(tmp_path, {"scan_rec.log": nrecon()}), spacing=(1, 2, 3))
    assert volume.spacing == (1, 2, 3)
    assert codes(volume) == ["W-OPTION-PREFERRED"]


def test_the_text_of_the_reconstruction_is_surer_than_that_of_the_scan(tmp_path):
    """Whatever the first is called; and the one with the slices' name than others."""
    scan = "[Acquisition]\nImage Pixel Size (um)=9.98\n"
    volume = read(stack(tmp_path, {"a.log": scan, "z.log": nrecon()}))
    assert volume.spacing == pytest.approx((0.0175,) * 3)
    assert any("a.log" in notice.sentence for notice in volume.warnings)
    volume = read(stack(tmp_path, {"a.log": nrecon(size=3), "scan_rec.log": nrecon(), "z.log": scan}))
    assert volume.spacing == pytest.approx((0.0175,) * 3)


def test_two_texts_that_differ_are_not_used(tmp_path):
    volume = read(stack(tmp_path, {"a.log": nrecon(), "z.log": nrecon(size=3)}))
    assert volume.spacing == (1, 1, 1)
    assert codes(volume)[:2] == ["W-GEOMETRY-CONTRADICTED", "W-SPACING-MISSING"]


def test_other_texts_are_left_out_by_name(tmp_path):
    texts = {"notes.txt": "nothing of use: 3\n", "many.log": "a" * 300_000, "odd.log": bytes(range(256)) * 9}
    volume = read(stack(tmp_path, texts))
    assert codes(volume) == ["W-SPACING-MISSING", "W-FILES-LEFT-OUT"]
    assert "many.log, notes.txt, odd.log" in volume.warnings[1].sentence
