"""Folders of PNG, BMP, JPEG and JPEG 2000 slices: values, order, gaps, what is left out or refused."""

import struct
import sys

import numpy as np
import pytest

from dmc_cli.errors import AmbiguousVolumeError, DamagedVolumeError, UnsupportedFormatError, VolumeError
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io import images
from dmc_cli.volume_io.read import list_volumes
from tests.cases import case
from tests.volume_io.reading import counting, read

PIL = pytest.importorskip("PIL.Image")

VALUES = counting((4, 6, 7), "u1")


def save(folder, names, values=VALUES):
    folder.mkdir(exist_ok=True)
    for name, plane in zip(names, values, strict=True):
        PIL.fromarray(plane).save(folder / name)
    return folder


def numbered(suffix, count=4, first=7):
    """Names whose order is that of their numbers, not that of their letters."""
    return [f"rec{first + k}{suffix}" for k in range(count)]


def codes(volume):
    return [notice.code for notice in volume.warnings]


def told(volume):
    return "; ".join(notice.sentence for notice in volume.warnings)


@pytest.mark.parametrize("suffix", [".png", ".bmp", ".PNG"])
def test_slices_are_in_the_order_of_their_numbers(tmp_path, suffix):
    volume = read(save(tmp_path, numbered(suffix)))
    np.testing.assert_array_equal(volume.values, VALUES)
    assert (volume.format, volume.space, volume.spacing) == ("images", "none", (1, 1, 1))
    assert [file.name for file in volume.files] == numbered(suffix)
    assert codes(volume) == ["W-SPACING-MISSING"]
    assert [entry.size for entry in list_volumes(str(tmp_path), ReadSettings())] == [(7, 6, 4)]


def test_the_stack_of_the_case_is_read():
    volume = read(case("png_stack"))
    files = sorted(case("png_stack").glob("*.png"))
    expected = np.array([np.asarray(PIL.open(file)) for file in files])
    assert volume.shape == (64, 48, 40)
    np.testing.assert_array_equal(volume.values, expected)
    assert "EXPECTED.txt" in told(volume)


@pytest.mark.parametrize(("dtype", "suffix"), [("<u2", ".png"), ("u1", ".png"), ("u1", ".bmp")])
def test_all_bits_of_grey_are_kept(tmp_path, dtype, suffix):
    values = np.random.default_rng(0).integers(0, np.iinfo(dtype).max, (3, 5, 4), dtype, endpoint=True)
    volume = read(save(tmp_path, numbered(suffix, 3), values))
    assert volume.values.dtype == np.dtype(dtype)
    np.testing.assert_array_equal(volume.values, values)


@pytest.mark.parametrize("dtype", ["u1", "<u2", "i1", "<i2"])
@pytest.mark.parametrize("suffix", [".jp2", ".j2k"])
def test_jpeg_2000_keeps_bits_and_signs(tmp_path, dtype, suffix):
    utils = pytest.importorskip("openjpeg.utils")
    info = np.iinfo(dtype)
    values = np.random.default_rng(0).integers(info.min // 8, info.max // 8, (3, 40, 32), dtype)
    for name, plane in zip(numbered(suffix, 3), values, strict=True):
        bits = info.bits - 3 + (1 if info.min else 0)
        (tmp_path / name).write_bytes(
            utils.encode_array(plane, bits_stored=bits, codec_format=int(suffix == ".jp2"))
        )
    volume = read(tmp_path)
    assert volume.values.dtype == np.dtype(dtype)
    np.testing.assert_array_equal(volume.values, values)


def test_grey_of_few_bits_is_what_is_stored(tmp_path):
    bits = VALUES % 2
    for name, plane in zip(numbered(".png"), bits, strict=True):
        PIL.fromarray(plane.astype(bool)).save(tmp_path / name)
    np.testing.assert_array_equal(read(tmp_path).values, bits)
    four = VALUES % 16
    for name, plane in zip(numbered(".png"), four, strict=True):
        (tmp_path / name).write_bytes(_png(plane, depth=4))
    np.testing.assert_array_equal(read(tmp_path).values, four)


def _png(plane, depth, color=0):
    """A PNG of grey values of so many bits, or of whatever colour type."""
    import zlib

    rows, columns = plane.shape[:2]
    lines = b""
    for row in plane.reshape(rows, -1):
        bits = "".join(format(int(value), f"0{depth}b") for value in row)
        bits += "0" * (-len(bits) % 8)
        lines += b"\0" + int(bits, 2).to_bytes(len(bits) // 8, "big")

    def chunk(kind, content):
        return (
            struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
        )

    head = struct.pack(">IIBBBBB", columns, rows, depth, color, 0, 0, 0)
    parts = chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(lines)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + parts


@pytest.mark.parametrize("mode", ["RGB", "RGBA", "P", "LA"])
@pytest.mark.parametrize("suffix", [".png", ".bmp"])
def test_grey_written_as_colours_is_grey(tmp_path, mode, suffix):
    if suffix == ".bmp" and mode == "LA":
        pytest.skip("BMP has no such mode")
    for name, plane in zip(numbered(suffix), VALUES, strict=True):
        image = PIL.fromarray(plane)
        if mode == "P":
            image.putpalette([n for k in range(255, -1, -1) for n in (k, k, k)])
        (image if mode == "P" else image.convert(mode)).save(tmp_path / name)
    np.testing.assert_array_equal(read(tmp_path).values, 255 - VALUES if mode == "P" else VALUES)


def test_colours_and_transparent_pixels_are_refused(tmp_path):
    colored = np.zeros((6, 7, 3), "u1")
    colored[2, 3, 1] = 1
    clear = np.full((6, 7, 4), 255, "u1")
    clear[0, 0, 3] = 0
    for k, plane in enumerate((colored, clear)):
        folder = save(tmp_path / str(k), numbered(".png", 2), [plane, plane])
        with pytest.raises(UnsupportedFormatError, match=r"rec7.png has colours or transparent pixels"):
            read(folder)


@pytest.mark.parametrize("color", [2, 6])
def test_grey_of_16_bits_written_as_colours_is_grey(tmp_path, color):
    """Pillow decodes eight bits of them."""
    parts = {2: 3, 6: 4}[color]
    values = np.random.default_rng(0).integers(0, 65536, (4, 6, 7))
    for name, plane in zip(numbered(".png"), values, strict=True):
        pixels = np.repeat(plane[..., None], parts, axis=2)
        pixels[..., 3:] = 65535
        (tmp_path / name).write_bytes(_png(pixels, depth=16, color=color))
    volume = read(tmp_path)
    assert volume.values.dtype == np.uint16
    np.testing.assert_array_equal(volume.values, values)
    for place in {2: [0], 6: [0, 3]}[color]:  # a colour that differs in the lower bits, and a clear pixel
        wrong = pixels.copy()
        wrong[2, 3, place] ^= 1
        (tmp_path / "rec10.png").write_bytes(_png(wrong, depth=16, color=color))
        with pytest.raises(UnsupportedFormatError, match=r"rec10.png has colours or transparent"):
            read(tmp_path)


@pytest.mark.parametrize("depth", [1, 2, 4])
def test_slices_of_other_bits_are_refused(tmp_path, depth):
    """ImageMagick writes an empty slice in as few bits as it takes: white is 1 there, and 255 elsewhere."""
    save(tmp_path, numbered(".png"))
    (tmp_path / "rec9.png").write_bytes(_png(VALUES[2] % 2, depth=depth))
    told = rf"rec9.png has {depth} bits a pixel, rec7.png has 8.*convert them to one depth"
    with pytest.raises(DamagedVolumeError, match=told):
        read(tmp_path)
    (tmp_path / "rec7.png").write_bytes(_png(VALUES[0] % 2, depth=depth))
    with pytest.raises(DamagedVolumeError, match=rf"rec8.png has 8 bits a pixel, rec7.png has {depth}"):
        read(tmp_path)


def test_an_image_to_be_turned_for_display_is_told(tmp_path):
    turned = PIL.Exif()
    turned[0x112] = 6
    for name, plane in zip(numbered(".jpg"), VALUES, strict=True):
        PIL.fromarray(plane).save(tmp_path / name, exif=turned)
    volume = read(tmp_path)
    assert volume.shape == (7, 6, 4)
    assert codes(volume) == ["W-SPACING-MISSING", "W-IMAGE-TURNED"]
    turned[0x112] = 1
    for name, plane in zip(numbered(".jpg"), VALUES, strict=True):
        PIL.fromarray(plane).save(tmp_path / name, exif=turned)
    assert codes(read(tmp_path)) == ["W-SPACING-MISSING"]


def test_the_case_of_letters_does_not_change_the_order(tmp_path):
    save(tmp_path, ["S1.png", "s2.PNG", "S3.Png", "s4.png"])
    np.testing.assert_array_equal(read(tmp_path).values, VALUES)


def test_a_file_that_is_no_image_is_told_in_words(tmp_path):
    save(tmp_path, numbered(".png"))
    (tmp_path / "rec8.png").write_bytes(b"II*\0 or something else")
    with pytest.raises(DamagedVolumeError, match=r"rec8.png cannot be read \(it begins like no PNG, BMP or"):
        read(tmp_path)


def test_slices_that_differ_are_refused(tmp_path):
    for other in (np.zeros((6, 8), "u1"), np.zeros((6, 7), "<u2")):
        save(tmp_path, numbered(".png"), [*VALUES[:3], other])
        with pytest.raises(DamagedVolumeError, match=r"rec10.png: .*expected .* as in rec7.png"):
            read(tmp_path)


def test_the_kind_of_most_files_wins_and_the_others_are_named(tmp_path):
    save(tmp_path, numbered(".png"))
    save(tmp_path, ["rec_spr.bmp", "rec_cor.png"], [np.zeros((9, 9), "u1")] * 2)
    (tmp_path / "Thumbs.db").write_bytes(b"\xd0\xcf\x11\xe0")
    volume = read(tmp_path)
    np.testing.assert_array_equal(volume.values, VALUES)
    assert codes(volume) == ["W-SPACING-MISSING", "W-FILES-LEFT-OUT"]
    assert "3 files were left out: rec_cor.png, Thumbs.db, rec_spr.bmp" in told(volume)


def test_as_many_files_of_two_kinds_are_ambiguous(tmp_path):
    save(save(tmp_path, numbered(".png")), numbered(".bmp"))
    with pytest.raises(AmbiguousVolumeError, match="4 BMP files and as many PNG files"):
        read(tmp_path)


def test_two_stacks_in_a_folder_are_ambiguous(tmp_path):
    save(save(tmp_path, [f"a{k}.png" for k in range(4)]), [f"b{k}.png" for k in range(4)])
    with pytest.raises(AmbiguousVolumeError, match="4 like a#, 4 like b#; expected one stack"):
        read(tmp_path)


def test_two_numbers_that_count_are_ambiguous(tmp_path):
    save(tmp_path, [f"z{k}_c{c}.png" for k in range(2) for c in range(2)])
    with pytest.raises(AmbiguousVolumeError, match="2 x 2 numbers count"):
        read(tmp_path)


def test_a_number_that_stands_twice_is_ambiguous(tmp_path):
    save(tmp_path, ["a1.png", "a2.png", "a3.png", "a03.png"])
    with pytest.raises(AmbiguousVolumeError, match=r"a03.png and a3.png|a3.png and a03.png"):
        read(tmp_path)


def test_names_without_a_number_are_in_their_order_and_that_is_told(tmp_path):
    volume = read(save(tmp_path, ["a.png", "b.png", "c.png", "d.png"]))
    np.testing.assert_array_equal(volume.values, VALUES)
    assert "W-ORDER-ASSUMED" in codes(volume)
    with pytest.raises(AmbiguousVolumeError, match="W-ORDER-ASSUMED"):
        read(tmp_path, strict=True, spacing=(1, 1, 1))


@pytest.mark.parametrize(
    ("pattern", "is_told"),
    [
        ("img_t{}", True),
        ("img_t{}_z0", True),
        ("T{}", True),
        ("a_time-{}", True),
        ("well3_ch{}", True),
        ("proj_{}", True),
        ("x angle {}", True),
        ("frame{}", True),
        ("img_t0_z{}", False),
        ("rot{}", True),
        ("test{}", False),
        ("mic{}", False),
        ("scan_rec{}", False),
        ("slice_{}", False),
        ("{}", False),
    ],
)
def test_files_that_are_numbered_by_something_else_than_slices_are_told(tmp_path, pattern, is_told):
    volume = read(save(tmp_path, [pattern.format(k) + ".png" for k in range(4)]), spacing=(1, 1, 1))
    np.testing.assert_array_equal(volume.values, VALUES)
    assert codes(volume) == ["W-AXES-MISSING"] * is_told


def test_missing_slices_are_refused_or_spanned(tmp_path):
    save(tmp_path, [f"a{k}.png" for k in (8, 10, 12, 18)])
    with pytest.raises(AmbiguousVolumeError, match=r"numbers 14, 16 missing.*go by 2.*--slice-gaps keep"):
        read(tmp_path)
    volume = read(tmp_path, slice_gaps="keep", spacing=(1, 1, 3))
    np.testing.assert_array_equal(volume.slice_positions, [0, 3, 6, 15])
    assert "W-SLICES-MISSING" in codes(volume)


def test_a_damaged_slice_is_told_by_its_name(tmp_path):
    save(tmp_path, numbered(".png"))
    content = (tmp_path / "rec8.png").read_bytes()
    for damaged in (content[:50], b"\x89PNG" + bytes(99), content[:60] + b"?????" + content[65:]):
        (tmp_path / "rec8.png").write_bytes(damaged)
        with pytest.raises(DamagedVolumeError, match=r"rec8.png cannot be read"):
            read(tmp_path)


def test_a_size_that_no_files_can_hold_is_refused(tmp_path):
    for name in numbered(".png"):
        (tmp_path / name).write_bytes(_png(np.zeros((1, 8), "u1"), depth=8))
        content = bytearray((tmp_path / name).read_bytes())
        content[16:24] = (9000).to_bytes(4, "big") * 2
        import zlib

        content[29:33] = zlib.crc32(bytes(content[12:29])).to_bytes(4, "big")
        (tmp_path / name).write_bytes(content)
    with pytest.raises(DamagedVolumeError, match="bytes found for 4 slices of 9000 x 9000 pixels"):
        read(tmp_path)


def test_a_single_image_is_no_volume(tmp_path):
    save(tmp_path, ["a1.png"], VALUES[:1])
    with pytest.raises(UnsupportedFormatError, match=r"a single image found.*the folder with all slices"):
        read(tmp_path / "a1.png")
    with pytest.raises(VolumeError, match="at least two along each axis"):
        read(tmp_path)
    (tmp_path / "a1.png").unlink()
    with pytest.raises(VolumeError, match="no PNG, BMP, JPEG or JPEG 2000 image found"):
        read(tmp_path, input_format="images")


def test_what_decodes_images_may_be_missing(tmp_path, monkeypatch):
    save(tmp_path, numbered(".png"))
    monkeypatch.setitem(sys.modules, "PIL", None)
    with pytest.raises(UnsupportedFormatError, match=r"Pillow is not installed; .*dmc-cli\[images"):
        read(tmp_path)
    monkeypatch.setitem(sys.modules, "openjpeg.utils", None)
    for name in numbered(".jp2", 5):
        (tmp_path / name).write_bytes(b"x")
    with pytest.raises(UnsupportedFormatError, match=r"openjpeg is not installed"):
        read(tmp_path)
    assert set(images.MISSING) == {"Pillow", "openjpeg"}


def test_links_out_of_the_folder_are_followed_when_asked(tmp_path):
    folder = save(tmp_path / "in", numbered(".png"))
    (folder / "rec8.png").rename(tmp_path / "out.png")
    (folder / "rec8.png").symlink_to(tmp_path / "out.png")
    with pytest.raises(VolumeError, match=r"rec8\.png is a link out of the folder"):
        read(folder)
    np.testing.assert_array_equal(read(folder, allow_outside=True).values, VALUES)


@pytest.mark.parametrize("suffix", [".png", ".bmp"])
@pytest.mark.parametrize(
    ("dots", "spacing", "told_of_it"),
    [
        (
            1451.43,
            1 / 57.143,
            "that of pixels of 0.0175 x 0.0175 mm, tells no spacing along z",
        ),
        (72, 1, "whose resolution of 72 dpi is that of a screen or printer, tells no spacing; 1 mm"),
        (96, 1, "of 96 dpi is that of a screen"),
        (600, 1, "of 600 dpi is that of a screen"),
    ],
)
def test_a_resolution_that_is_none_of_print_is_a_distance(tmp_path, suffix, dots, spacing, told_of_it):
    for name, plane in zip(numbered(suffix), VALUES, strict=True):
        PIL.fromarray(plane).save(tmp_path / name, dpi=(dots, dots))
    volume = read(tmp_path)
    np.testing.assert_allclose(volume.spacing, (spacing, spacing, 1))
    assert codes(volume) == ["W-SPACING-MISSING"]
    assert told_of_it in told(volume)
    assert read(tmp_path, spacing=(1, 2, 3)).sentences == ()


@pytest.mark.parametrize(
    ("box", "spacing"),
    [
        (b"resc" + struct.pack(">4H2b", 4, 7, 2, 7, 5, 5), (0.035, 0.0175, 1)),
        (b"resc" + struct.pack(">4H2b", 28346, 10000, 28346, 10000, 3, 3), (1, 1, 1)),
        (b"resd" + struct.pack(">4H2b", 4, 7, 2, 7, 5, 5), (1, 1, 1)),
        (b"resc" + struct.pack(">4H2b", 4, 0, 2, 7, 5, 5), (1, 1, 1)),
        (b"resc", (1, 1, 1)),
    ],
)
def test_the_resolution_at_which_a_jpeg_2000_was_captured(tmp_path, box, spacing):
    """A number of dots a metre along y, then x: a fraction and a power of ten each."""
    utils = pytest.importorskip("openjpeg.utils")
    for name, plane in zip(numbered(".jp2"), counting((4, 40, 32), "u1"), strict=True):
        content = utils.encode_array(plane, codec_format=1)
        place = content.index(b"jp2h") - 4
        size = int.from_bytes(content[place : place + 4], "big")
        inner = struct.pack(">I", len(box) + 4) + box
        inner = struct.pack(">I4s", len(inner) + 8, b"res ") + inner
        head = struct.pack(">I", size + len(inner)) + content[place + 4 : place + size] + inner
        (tmp_path / name).write_bytes(content[:place] + head + content[place + size :])
    volume = read(tmp_path)
    np.testing.assert_allclose(volume.spacing, spacing)
    assert codes(volume) == ["W-SPACING-MISSING"]
