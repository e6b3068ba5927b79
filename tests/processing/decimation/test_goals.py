"""Scans to a quarter and a tenth of their quads are as near, as regular and as square as is promised.

Distances are in voxels; the first is that to the fine mesh, the second from it.
"""

import pytest

from dmc_cli.contouring import connect_faces
from dmc_cli.measures.distance import measure_distance
from dmc_cli.measures.intersections import find_intersections
from dmc_cli.measures.quality import measure_quality
from dmc_cli.mesh.valences import irregular_percent
from dmc_cli.processing.decimation import decimate
from dmc_cli.settings import ReadSettings
from dmc_cli.volume_io.read import read_volume
from tests.mesh.meshes import relaxed, simplified
from tests.processing.remeshing.test_rounds import assert_whole, turned_pairs

BONE = "raw/trabecular_crop_128x128x128_uint8.raw"


def assert_near(result, before, means, largest):
    found = measure_distance(result.mesh, before.mesh)
    assert found.to_other.mean <= means[0]
    assert found.from_other.mean <= means[1]
    assert found.to_other.max <= largest[0]
    assert found.from_other.max <= largest[1]


def assert_decimated(result, before, wanted):
    assert result.mesh.face_count == wanted
    assert_whole(before, result)
    assert turned_pairs(result) <= turned_pairs(before)
    assert not len(find_intersections(result.mesh))


@pytest.mark.slow
def test_a_tooth(extract, sample_data):
    volume = read_volume(str(sample_data / "nrrd" / "tooth.nrrd"), ReadSettings())
    before = connect_faces(extract(volume, 500.0, threads=2))
    quads = before.mesh.face_count
    quarter = decimate(before.mesh, before.placement, round(quads / 4))
    assert_decimated(quarter, before, round(quads / 4))
    largest = 0.5 if before.mesh.device.name == "cpu" else 0.6  # of one quad: 0.44 to 0.56 near this number
    assert_near(quarter, before, (0.04, 0.055), (largest, 1.0))
    assert irregular_percent(quarter.mesh) <= 5.5  # 14 are allowed
    tenth = decimate(before.mesh, before.placement, quads // 10)
    assert_decimated(tenth, before, quads // 10)
    assert_near(tenth, before, (0.075, 0.075), (1.0, 1.0))  # from it 2.5 are allowed
    smooth = relaxed(simplified(before), 10)  # which uses up the arrays of the surface
    assert measure_quality(quarter.mesh).shape_mean > measure_quality(smooth.mesh).shape_mean


@pytest.mark.slow
def test_a_bone(extract, sample_data):
    settings = ReadSettings(shape=(128, 128, 128), dtype="uint8")
    volume = read_volume(str(sample_data / BONE), settings)
    before = connect_faces(extract(volume, 85.0, threads=2))
    wanted = before.mesh.face_count // 4
    result = decimate(before.mesh, before.placement, wanted)
    assert_decimated(result, before, wanted)
    assert_near(result, before, (0.06, 0.09), (1.0, 1.0))
