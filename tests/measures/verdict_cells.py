"""Verdict's measures of single faces by VTK, and random faces to measure."""

import numpy as np
import pytest


def vtk_measure(shape, name):
    """Verdict's value of each face of a mesh of quads and triangles."""
    pytest.importorskip("vtkmodules", reason="vtk, which checks the measures, is not installed")
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import VTK_QUAD, VTK_TRIANGLE, vtkUnstructuredGrid
    from vtkmodules.vtkFiltersVerdict import vtkCellQuality

    points, faces = shape
    grid, at = vtkUnstructuredGrid(), vtkPoints()
    at.SetData(numpy_to_vtk(np.asarray(points, np.float64), deep=True))
    grid.SetPoints(at)
    for face in faces.tolist():
        corners = [v for v in face if v >= 0]
        grid.InsertNextCell(VTK_QUAD if len(corners) == 4 else VTK_TRIANGLE, len(corners), corners)
    judge = vtkCellQuality()
    judge.SetInputData(grid)
    getattr(judge, f"SetQualityMeasureTo{name}")()
    judge.Update()
    return vtk_to_numpy(judge.GetOutput().GetCellData().GetArray("CellQuality")).copy()


def random_faces(seed, corners, count=400, bend=0.25):
    """Separate faces of so many corners, from nearly regular to far from it."""
    rng = np.random.default_rng(seed)
    ring = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)[:corners]
    points = ring + rng.normal(0, 1, (count, 1, 1)) * rng.normal(0, bend, (count, corners, 3))
    points = (points * rng.uniform(0.2, 5, (count, 1, 1)) + rng.normal(0, 3, (count, 1, 3))).astype(
        np.float32
    )
    faces = np.full((count, 4), -1, np.int32)
    faces[:, :corners] = np.arange(corners * count).reshape(count, corners)
    return points.reshape(-1, 3), faces
