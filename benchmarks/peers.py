"""The programs that dmc is compared with, each as a function from a volume to a count of faces."""

import numpy as np
import vtk
import warp as wp
import warp.geometry
from skimage.measure import marching_cubes
from vtk.util.numpy_support import numpy_to_vtk

from dmc_cli.volume import Volume

THREADS = 2


def flying_edges(volume: Volume, level: float, *, normals: bool = False):
    """vtkFlyingEdges3D on the STDThread backend; the image wraps the same memory."""
    vtk.vtkSMPTools.SetBackend("STDThread")
    vtk.vtkSMPTools.Initialize(THREADS)
    image = vtk.vtkImageData()
    image.SetDimensions(*volume.shape)
    image.GetPointData().SetScalars(numpy_to_vtk(volume.values.ravel(), deep=False))

    def run() -> int:
        contour = vtk.vtkFlyingEdges3D()
        contour.SetInputData(image)
        contour.SetValue(0, level)
        contour.SetComputeNormals(normals)
        contour.ComputeGradientsOff()
        contour.ComputeScalarsOff()
        contour.Update()
        return contour.GetOutput().GetNumberOfCells()

    return run


def scikit_image(volume: Volume, level: float):
    """scikit-image's marching_cubes (Lewiner), which uses one thread."""
    values = volume.values.copy()  # it refuses an array that is read-only

    def run() -> int:
        return len(marching_cubes(values, level)[1])

    return run


def surface_nets(volume: Volume, level: float):
    """Warp's own IsoSurfaceNets with quads; its field is float32 and negative inside."""
    nx, ny, nz = volume.shape
    values = np.ascontiguousarray(volume.values.astype(np.float32).transpose(2, 1, 0))
    field = wp.array(values, dtype=wp.float32, device="cpu")
    nets = wp.geometry.IsoSurfaceNets(nx, ny, nz, topology="quad")
    small = wp.array(np.ones((4, 4, 4), np.float32) - 2 * np.eye(4, dtype=np.float32), device="cpu")
    wp.geometry.IsoSurfaceNets(4, 4, 4, topology="quad").surface(small, 0.0)  # compile its kernels

    def run() -> int:
        nets.surface(field, level)
        return nets.indices.shape[0] // 4

    return run
