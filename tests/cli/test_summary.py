"""The lines that people read, word for word."""

import pytest

from dmc_cli.cli.summary import doctor_lines, info_lines, measure_lines, summary_lines

INPUT = {"shape": [4, 5, 6], "spacing_mm": [0.123456, 1.0, 2.5], "dtype": "int16", "space": "LPS"}
TOPOLOGY = {
    "non_manifold_edges": 0,
    "non_manifold_vertices": 0,
    "boundary_loops": 0,
    "components": 2,
    "genus": 1.0,
    "euler_characteristic": 2,
    "valence_histogram": {"3": 8, "4": 20},
    "irregular_percent": 28.5714,
}


def report(**changes):
    made = {
        "warnings": [],
        "warning_codes": [],
        "input": INPUT,
        "settings": {"space": "native"},
        "surface": {"isovalue": 300.0, "stored_isovalue": 300.0},
        "mesh": {"vertices": 12, "quads": 10, "area": None, "volume": None, "unit": "mm"},
        "topology": None,
        "deviation": None,
        "timings_ms": None,
    }
    return list(summary_lines(made | changes))


def test_a_conversion_that_measured_nothing():
    assert report() == [
        "volume    4 x 5 x 6 nodes of int16, 0.1235 x 1 x 2.5 mm, LPS",
        "surface   isovalue 300",
        "mesh      12 vertices, 10 quads, LPS",
    ]


def test_a_conversion_with_all_that_there_is():
    lines = report(
        warnings=["one", "two"],
        warning_codes=["W-ONE", "W-TWO"],
        surface={"isovalue": 300.0, "stored_isovalue": 1323.5},
        mesh={"vertices": 12, "quads": 10, "area": 1234567.89, "volume": -0.0001234, "unit": "mm"},
        topology=TOPOLOGY,
        quality={"self_intersections": 3},
        deviation={"max_relative": 1.234e-8, "max_mm": None, "rounding_mm": 1.5e-5},
        timings_ms={"total": 1234.5, "compile": 0.0, "relax": 340.4, "surface": 20.0, "coloring": 9.0},
    )
    assert lines[:2] == ["warning: one (W-ONE)", "warning: two (W-TWO)"]
    assert lines[3:] == [
        "surface   isovalue 300, cut at the stored value 1323.5",
        "mesh      12 vertices, 10 quads, area 1.23457e+06 mm², volume -0.0001234 mm³, LPS",
        "topology  manifold, closed, 2 component(s), genus 1",
        "faces     3 pair(s) intersect",
        "deviation at most 1.2e-08 of the value range, unknown mm; rounding at most 1.5e-05 mm",
        "time      1.23 s (surface 0.02, relax 0.34)",
    ]
    assert report(timings_ms={"total": 10.0})[-1] == "time      0.01 s"
    assert report(quality={"self_intersections": 0})[-1] == "faces     no two intersect"
    assert report(quality={"self_intersections": None}) == report()


@pytest.mark.parametrize(
    ("asked", "stored", "told"),
    [
        ("native", "none", "no space"),
        ("native", "RAS", "RAS"),
        ("lps", "RAS", "LPS"),
        ("ras", "LPS", "RAS"),
        ("voxel", "RAS", "grid indices"),
        ("tkr", "LPS", "tkrRAS"),
    ],
)
def test_the_space_of_the_mesh(asked, stored, told):
    mesh = {"vertices": 1, "quads": 1, "area": 1.5, "volume": 2.5}
    mesh["unit"] = "voxel" if asked == "voxel" else "mm"
    line = report(settings={"space": asked}, input=INPUT | {"space": stored}, mesh=mesh)[2]
    unit = ("", "") if asked == "voxel" else (" mm²", " mm³")
    assert line == f"mesh      1 vertices, 1 quads, area 1.5{unit[0]}, volume 2.5{unit[1]}, {told}"


def test_another_unit_of_the_mesh():
    mesh = {"vertices": 1, "quads": 1, "area": None, "volume": None, "unit": "um"}
    assert report(mesh=mesh)[2] == "mesh      1 vertices, 1 quads, LPS in um"


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"boundary_loops": 3}, "topology  manifold, open (3 boundary loop(s)), 2 component(s), genus 1"),
        (
            {"non_manifold_edges": 1, "genus": None},
            "topology  not manifold (1 edge(s), 0 vertices), closed, 2 component(s)",
        ),
        (
            {"non_manifold_vertices": 1, "genus": 0.5},
            "topology  not manifold (0 edge(s), 1 vertices), closed, 2 component(s), genus 0.5",
        ),
    ],
)
def test_the_topology(changes, line):
    assert report(topology=TOPOLOGY | changes)[-1] == line


def measured(**changes):
    quality = {"shape_mean": 0.123456, "shape_min": 0.123456, "mean_ratio_mean": 0.87654}
    quality |= {"scaled_jacobian_min": None, "min_angle": 41.16789, "max_angle": 142.8}
    quality |= {"aspect_ratio_max": 2.3456, "skew_max": 0.51234, "taper_max": None, "stretch_min": 0.2345}
    quality |= {"triangle_scaled_jacobian_min": 0.34567}
    quality |= {"radius_ratio_mean": 0.81234, "radius_ratio_min": 0.012345, "self_intersections": 0}
    made = {
        "warnings": [],
        "warning_codes": [],
        "mesh": {"vertices": 12, "quads": 10, "triangles": 0, "unit": "mm"},
        "topology": TOPOLOGY,
        "quality": quality,
        "deviation": None,
        "curvature": None,
        "distance": None,
        "thickness": None,
    }
    return list(measure_lines(made | changes))


def test_a_mesh_file():
    assert measured() == [
        "mesh      12 vertices, 10 quads",
        "topology  manifold, closed, 2 component(s), genus 1, Euler characteristic 2",
        "valences  8 of 3, 20 of 4; 28.57 % irregular",
        "shape     mean 0.1235, least 0.12; mean ratio 0.8765; scaled Jacobian at least unknown",
        "angles    41.17 to 142.8 degrees",
        "elements  aspect ratio at most 2.35, skew at most 0.512, taper at most unknown,"
        " stretch at least 0.23, radius ratio of triangles mean 0.8123, least 0.012",
        "faces     no two intersect",
    ]
    mesh = {"vertices": 12, "quads": 0, "triangles": 20, "unit": "mm"}
    deviation = {"mean": 0.00018, "max": 0.00234, "max_relative": 1.8e-6, "max_mm": 8.1e-6}
    lines = measured(warnings=["one"], warning_codes=["W-ONE"], mesh=mesh, deviation=deviation)
    assert lines[:2] == ["warning   one (W-ONE)", "mesh      12 vertices, 0 quads, 20 triangles"]
    told = "deviation mean 0.00018, at most 0.0023 in values, 1.8e-06 of their range, 8.1e-06 mm"
    assert lines[-1] == told
    assert lines[4] == "shape     mean ratio 0.8765; scaled Jacobian of triangles at least 0.35"
    assert lines[-3] == "elements  radius ratio of triangles mean 0.8123, least 0.012"


def test_curvature_and_distance_of_a_mesh_file():
    spread = {"mean": 0.51234, "min": -1.0, "max": 2.34567, "percentile_5": 0.1, "percentile_95": None}
    way = {"samples": 1200, "mean": 0.0123456, "percentile_95": 0.05, "max": None}
    distance = {"unit": "um", "to_other": way, "from_other": way | {"samples": 7}}
    lines = measured(curvature={"mean": spread, "gaussian": spread}, distance=distance)
    bend = "0.512 over the area, -1 to 2.35, of nine in ten vertices 0.1 to unknown"
    far = "mean 0.0123, 95 % within 0.05, at most unknown um"
    assert lines[-4:] == [
        f"curvature mean: {bend}",
        f"          Gaussian: {bend}",
        f"distance  to the other mesh: {far} (1200 samples)",
        f"          from it: {far} (7 samples)",
    ]


def entry(number, **changes):
    told = {"number": number, "modality": "", "size": [4, 5, 6], "description": "nrrd", "uid": ""}
    return told | {"volumes": []} | changes


VOLUME = {
    "format": "dicom",
    "files": 40,
    **INPUT,
    "value_range": [-1024.0, 3071.5],
    "slope": 1.0,
    "intercept": 0.0,
    "affine": [[1.0, 0.0, -0.0, -12.3456789], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
}


def test_a_volume():
    lines = list(
        info_lines(
            {"path": "scan", **VOLUME, "series": [entry(1)], "warnings": ["one"], "warning_codes": ["W-ONE"]}
        )
    )
    assert lines == [
        "path      scan",
        "format    dicom, 40 file(s)",
        "volume    4 x 5 x 6 nodes of int16, 0.1235 x 1 x 2.5 mm, LPS",
        "values    -1024 to 3071.5",
        "affine    1 0 0 -12.3457; 0 1 0 0; 0 0 1 0",
        "warning   one (W-ONE)",
    ]


@pytest.mark.parametrize(("slope", "intercept"), [(2.0, 0.0), (1.0, -1024.0)])
def test_a_volume_of_scaled_values_and_one_without_any(slope, intercept):
    changes = {"slope": slope, "intercept": intercept, "value_range": None}
    lines = list(info_lines({"path": "scan", **VOLUME, **changes, "series": []}))
    assert lines[3] == "values    none that is finite"
    assert lines[4] == f"scaling   {slope:g} * stored value + {intercept:g}"


def test_the_series_of_a_folder():
    series = [entry(1, modality="CT", description="thorax", uid="1.2"), entry(12, uid="1.3", description="")]
    lines = list(info_lines({"path": "folder", "series": series}))
    assert lines == [
        "path      folder",
        "series    choose one with --series",
        "  1     CT  4 x 5 x 6  thorax  1.2",
        "  12    4 x 5 x 6  1.3",
    ]
    chosen = list(info_lines({"path": "folder", **VOLUME, "series": series}))
    assert not any("choose one" in line for line in chosen)
    assert chosen[-2:] == lines[-2:]
    alone = list(info_lines({"path": "folder", **VOLUME, "series": series[:1]}))
    assert alone[-1] == lines[2]


@pytest.mark.parametrize(("count", "shown"), [(1, 0), (2, 2), (100, 100), (102, 100)])
def test_the_volumes_of_a_file(count, shown):
    listed = entry(1, volumes=[f"time {n}" for n in range(count)])
    lines = list(info_lines({"path": "scan", **VOLUME, "series": [listed]}))[5:]
    expected = ["volumes   choose one with --volume-index", *(f"  {n:<4}  time {n}" for n in range(shown))]
    more = ["  and 2 more; --json has them all"] if count > shown > 1 else []
    assert lines == (expected + more if shown else [])


def diagnosis(*devices):
    return {
        "platform": "Linux",
        "python": "3.11",
        "packages": {"numpy": "2.0", "zarr": None},
        "cpu_cores": 8,
        "devices": [{"alias": "cpu", "name": "x86_64", "memory_bytes": None}, *devices],
        "codecs": {"RLE": True, "HTJ2K": False},
        "launches": {"threads": 8, "fallback": None},
        "kernel_cache": {"modules": 3, "bytes": 3 << 19, "path": "/cache"},
    }


def test_an_installation():
    assert list(doctor_lines(diagnosis())) == [
        "platform  Linux",
        "python    3.11",
        "packages  numpy 2.0, zarr missing",
        "device    cpu: x86_64 8 core(s)",
        "device    cuda: no usable CUDA device was found; everything runs on the CPU",
        "codec     DICOM RLE: available",
        "codec     DICOM HTJ2K: missing",
        "launches  8 CPU thread(s) share each",
        "kernels   3 compiled module(s), 1.5 MiB in /cache",
    ]
    card = {"alias": "cuda:0", "name": "H100", "memory_bytes": 80 << 30}
    lines = list(doctor_lines(diagnosis(card)))
    assert lines[3:5] == ["device    cpu: x86_64 8 core(s)", "device    cuda:0: H100 80.0 GiB"]
    assert not any("no usable CUDA" in line for line in lines)


def test_the_kernels_of_the_cache_are_counted(tmp_path, monkeypatch):
    import warp as wp

    from dmc_cli.cli.description import _kernel_cache

    monkeypatch.setattr(wp.config, "kernel_cache_dir", str(tmp_path))
    (tmp_path / "module").mkdir()
    for name in ("a.o", "b.cubin", "c.ptx", "d.cpp", "e.meta"):
        (tmp_path / "module" / name).write_bytes(b"12345")
    assert _kernel_cache() == {"path": str(tmp_path), "modules": 3, "bytes": 25}
    monkeypatch.setattr(wp.config, "kernel_cache_dir", str(tmp_path / "missing"))
    assert _kernel_cache() == {"path": str(tmp_path / "missing"), "modules": 0, "bytes": 0}
