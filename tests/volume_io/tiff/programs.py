"""TIFFs with the tags of microscopes and other programs, written by hand as their descriptions have them."""

import json
import struct

import numpy as np
import pytest

tifffile = pytest.importorskip("tifffile")

BYTES, ASCII, SHORT, LONG, DOUBLE = 7, 2, 3, 4, 12


def record(dtype, **fields):
    """Bytes of one of the structures that tifffile knows, zero but for some fields."""
    found = np.zeros(1, np.dtype(dtype))
    for name, value in fields.items():
        found[name] = value
    return found.tobytes()


def write(path, values, tags, software="a microscope", description="", **options):
    """Write pages with tags (code, type, content) and nothing of tifffile's own."""
    counts = {BYTES: len, ASCII: len, SHORT: len, DOUBLE: len}
    extra = [(code, kind, counts[kind](content), content, True) for code, kind, content in tags]
    told = {"metadata": None, "photometric": "minisblack", "software": software}
    tifffile.imwrite(path, values, extratags=extra, description=description or None, **told, **options)
    return path


def write_lsm(path, values, sizes):
    """Zeiss: an image and a thumbnail by turns, voxels in metres."""
    nz, ny, nx = values.shape
    info = {"DimensionX": nx, "DimensionY": ny, "DimensionZ": nz, "DimensionChannels": 1, "DimensionTime": 1}
    info |= {f"VoxelSize{axis}": size for axis, size in zip("XYZ", sizes, strict=True)}
    content = record(tifffile.TIFF.CZ_LSMINFO, MagicNumber=67127628, StructureSize=500, **info)
    told = {"metadata": None, "photometric": "minisblack"}
    with tifffile.TiffWriter(path, byteorder="<") as file:
        for k, plane in enumerate(values):
            tags = [(34412, BYTES, len(content), content, True)] if k == 0 else ()
            file.write(plane, extratags=tags, **told)
            file.write(plane[:2, :2].astype("u1"), subfiletype=1, **told)
    return path


def write_stk(path, values, steps, pixel=(1, 2), unit="um", is_calibrated=1, times=None):
    """MetaMorph: one page with all planes behind it, rational numbers, distances of planes in UIC2."""
    nz, ny, nx = values.shape
    data, place = values.astype("<u2").tobytes(), 8
    entries, extra = [], b""
    start = place + len(data)  # of what entries point to

    def put(content):
        nonlocal extra
        extra += content
        return start + len(extra) - len(content)

    fraction = put(struct.pack("<2I", *pixel))
    text = put(struct.pack("<I", len(unit) + 1) + unit.encode() + b"\0")
    known = ((3, is_calibrated), (4, fraction), (5, fraction), (6, text))
    uic1 = put(b"".join(struct.pack("<2I", *each) for each in known))
    times = times or [0] * nz
    day = 2459581
    rows = [struct.pack("<6I", *steps[k], day, times[k], day, 0) for k in range(nz)]
    uic2 = put(b"".join(rows))
    for code, kind, count, value in (
        *((254, LONG, 1, 0), (256, LONG, 1, nx), (257, LONG, 1, ny), (258, SHORT, 1, 16), (259, SHORT, 1, 1)),
        *((262, SHORT, 1, 1), (273, LONG, 1, place), (277, SHORT, 1, 1), (278, LONG, 1, ny)),
        *((279, LONG, 1, nx * ny * 2), (33628, LONG, len(known), uic1), (33629, 5, nz, uic2)),
    ):
        entries.append(struct.pack("<HHII", code, kind, count, value))
    directory = struct.pack("<H", len(entries)) + b"".join(entries) + bytes(4)
    path.write_bytes(b"II*\0" + struct.pack("<I", start + len(extra)) + data + extra + directory)
    return path


def write_fluoview(path, values, axes):
    """Olympus: axes of a name, a size, a resolution and a unit each."""
    rows = [(name.encode(), size, 0.0, step, unit.encode()) for name, size, step, unit in axes]
    rows += [(b"", 0, 0.0, 0.0, b"")] * (10 - len(rows))
    content = record(tifffile.TIFF.MM_HEADER, HeaderFlag=1, Dimensions=np.array(rows, tifffile_dimensions()))
    stamp = np.zeros(8).tobytes()
    return write(path, values, [(34361, BYTES, content), (34362, BYTES, stamp)], byteorder="<")


def tifffile_dimensions():
    """Type of an axis in FluoView's header."""
    return np.dtype(tifffile.TIFF.MM_HEADER)["Dimensions"].base


def write_fei(path, values, x="5e-9", y="6e-9"):
    """Thermo Fisher: sections and keys, lengths in metres."""
    text = f"[User]\r\nDate=01/02/2026\r\n[Scan]\r\nPixelWidth={x}\r\nPixelHeight={y}\r\nAverage=1\r\n"
    return write(path, values, [(34682, ASCII, text)])


def write_sem(path, values, pixel="Image Pixel Size = 5.585 nm"):
    """Zeiss: numbers, then a key in capital letters and a line for each."""
    text = f"0\r\n0\r\n0\r\nAP_IMAGE_PIXEL_SIZE\r\n{pixel}\r\nAP_MAG\r\nMag = 20 K X\r\n"
    return write(path, values, [(34118, ASCII, text.encode("latin-1"))])


def write_nih(path, values, scale=4.0, unit=6, version=155, aspect=1.0):
    """NIH Image: pixels a unit, big endian."""
    fields = {"XScale": scale, "UnitsID": unit, "Version": version, "PixelAspectRatio": aspect}
    content = record(np.dtype(tifffile.TIFF.NIH_IMAGE_HEADER).newbyteorder(">"), FileID=b"IPICIMAG", **fields)
    return write(path, values, [(43314, BYTES, content)], byteorder=">")


def write_geotiff(path, values, scale=(2.0, 3.0, 4.0), model=1, unit=9001):
    """A map: a scale, keys of its model (1 a projection, 2 degrees) and its unit."""
    keys = [(1024, 0, 1, model), *([(3076, 0, 1, unit)] if unit else [])]
    listed = [1, 1, 0, len(keys), *(number for key in keys for number in key)]
    return write(path, values, [(33550, DOUBLE, scale), (34735, SHORT, listed)])


def write_metaseries(path, values, x="0.25", unit="um", state="on"):
    """MetaMorph's successor: XML of properties."""
    told = (
        ("spatial-calibration-state", "bool", state),
        ("spatial-calibration-x", "float", x),
        ("spatial-calibration-y", "float", "0.5"),
        ("spatial-calibration-units", "string", unit),
    )
    props = "".join(f'<prop id="{key}" type="{kind}" value="{value}"/>' for key, kind, value in told)
    xml = f"<MetaData><PlaneInfo>{props}</PlaneInfo></MetaData>"
    return write(path, values, [], software="MetaSeries", description=xml)


def write_micromanager(path, values, pixel=0.325):
    """Micro-Manager's frames, whose key names the unit."""
    text = json.dumps({"PixelSizeUm": pixel, "Width": values.shape[-1]})
    return write(path, values, [(51123, ASCII, text)])
