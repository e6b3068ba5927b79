"""Draw two meshes side by side, the second one from near by with its quads: the picture of the README.

dmc convert sample_data/dicom/head_ct skull.ply -i 300
dmc convert sample_data/nrrd/tooth.nrrd tooth.ply -i 500 --simplify all --relax 10
python docs/render.py skull.ply tooth.ply docs/meshes.jpg
"""

import sys

import vtk

WIDTH, HEIGHT = 1200, 600
BONE, BACKGROUND, LINES = (0.93, 0.89, 0.80), (1.0, 1.0, 1.0), (0.25, 0.25, 0.3)


def actor(path: str, *, edges: bool) -> vtk.vtkActor:
    """Return a mesh of a PLY file to draw."""
    reader = vtk.vtkPLYReader()
    reader.SetFileName(path)
    mapper = vtk.vtkPolyDataMapper()
    mapper.SetInputConnection(reader.GetOutputPort())
    mapper.ScalarVisibilityOff()
    drawn = vtk.vtkActor()
    drawn.SetMapper(mapper)
    look = drawn.GetProperty()
    look.SetColor(*BONE)
    look.SetSpecular(0.2)
    if edges:
        look.EdgeVisibilityOn()
        look.SetEdgeColor(*LINES)
        look.SetLineWidth(1.2)
    return drawn


def view(
    drawn: vtk.vtkActor, place: tuple[float, ...], turn: tuple[float, float], zoom: float
) -> vtk.vtkRenderer:
    """Return a mesh seen from (azimuth, elevation) in its part of the window."""
    renderer = vtk.vtkRenderer()
    renderer.SetViewport(*place)
    renderer.SetBackground(*BACKGROUND)
    renderer.AddActor(drawn)
    camera = renderer.GetActiveCamera()
    camera.SetPosition(0.0, -1.0, 0.0)
    camera.SetViewUp(0.0, 0.0, 1.0)
    camera.Azimuth(turn[0])
    camera.Elevation(turn[1])
    renderer.ResetCamera()
    camera.Zoom(zoom)
    return renderer


def main() -> None:
    """Draw the meshes of the command line."""
    left, right, picture = sys.argv[1:]
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetSize(WIDTH, HEIGHT)
    window.SetMultiSamples(8)
    window.AddRenderer(view(actor(left, edges=False), (0.0, 0.0, 0.5, 1.0), (30.0, 20.0), 1.4))
    window.AddRenderer(view(actor(right, edges=True), (0.5, 0.0, 1.0, 1.0), (30.0, 20.0), 4.0))
    window.Render()
    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(window)
    writer = vtk.vtkJPEGWriter()
    writer.SetQuality(80)
    writer.SetFileName(picture)
    writer.SetInputConnection(grab.GetOutputPort())
    writer.Write()


if __name__ == "__main__":
    main()
