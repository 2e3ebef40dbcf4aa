"""Draws a converted model: its base triangles beside the smooth patches with reflection lines.

usage: draw.py SURFACE.npz PICTURE.png

Positions and normals come from the control points in the npz, not from the library. Reflection
lines show smoothness: they break where tangent planes do.
"""

import sys
from math import comb

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray

DEGREE = 7
SAMPLES = 16
STRIPES = 7


def exponents(n):
    return [(n - r, r - k, k) for r in range(n + 1) for k in range(r + 1)]


def bernstein(n, points):
    """Rows: points; columns: Bernstein polynomials of degree n in storage order."""
    u, v, w = points.T
    return np.stack(
        [comb(n, i) * comb(n - i, j) * u**i * v**j * w**k for i, j, k in exponents(n)], axis=1
    )


def derivative(points, direction):
    """Weights of the control points in the derivative from corner 0 towards a corner."""
    column = {e: c for c, e in enumerate(exponents(DEGREE))}
    lower = bernstein(DEGREE - 1, points)
    weights = np.zeros((len(points), len(column)))
    for c, (i, j, k) in enumerate(exponents(DEGREE - 1)):
        ahead = (i, j + 1, k) if direction == 1 else (i, j, k + 1)
        weights[:, column[ahead]] += DEGREE * lower[:, c]
        weights[:, column[(i + 1, j, k)]] -= DEGREE * lower[:, c]
    return weights


def patches(nets):
    """Points, unit normals and triangles of a fine tessellation."""
    grid = np.array(exponents(SAMPLES)) / SAMPLES
    points = np.einsum("sc,fcx->fsx", bernstein(DEGREE, grid), nets)
    along = [np.einsum("sc,fcx->fsx", derivative(grid, d), nets) for d in (1, 2)]
    normals = np.cross(*along)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    small = []
    for r in range(SAMPLES):
        for k in range(r + 1):
            a = r * (r + 1) // 2 + k
            b = a + r + 1
            small.append((a, b, b + 1))
            if k < r:
                small.append((a, b + 1, a + 1))
    offsets = np.arange(len(nets))[:, None, None] * len(grid)
    triangles = (np.array(small)[None] + offsets).reshape(-1, 3)
    return points.reshape(-1, 3), normals.reshape(-1, 3), triangles


def actor(points, triangles, normals=None, colours=None):
    data = vtk.vtkPolyData()
    at = vtk.vtkPoints()
    at.SetData(numpy_to_vtk(np.ascontiguousarray(points), deep=True))
    data.SetPoints(at)
    cells = np.hstack([np.full((len(triangles), 1), 3), triangles]).astype(np.int64).ravel()
    polygons = vtk.vtkCellArray()
    polygons.ImportLegacyFormat(numpy_to_vtkIdTypeArray(cells, deep=True))
    data.SetPolys(polygons)
    if normals is not None:
        data.GetPointData().SetNormals(numpy_to_vtk(np.ascontiguousarray(normals), deep=True))
    if colours is not None:
        data.GetPointData().SetScalars(numpy_to_vtk(np.ascontiguousarray(colours), deep=True))
    mapper = vtk.vtkPolyDataMapper()
    mapper.SetInputData(data)
    shown = vtk.vtkActor()
    shown.SetMapper(mapper)
    return shown


def reflection_lines(points, normals, eye):
    """Stripes by the height at which the reflected ray leaves."""
    view = points - eye
    view /= np.linalg.norm(view, axis=1, keepdims=True)
    reflected = view - 2 * np.sum(view * normals, axis=1, keepdims=True) * normals
    wave = np.sin(STRIPES * np.arcsin(np.clip(reflected[:, 2], -1, 1)))
    # A soft step: hard ones would show the tessellation.
    stripe = 0.5 + 0.5 * np.tanh(6 * wave)
    dark, bright = np.array([40, 44, 52]), np.array([244, 214, 150])
    return (dark + stripe[:, None] * (bright - dark)).astype(np.uint8)


def main(source, target):
    surface = np.load(source)
    vertices, faces = surface["vertices"], surface["faces"].astype(np.int64)
    size = np.linalg.norm(np.ptp(vertices, axis=0))
    centre = (vertices.max(axis=0) + vertices.min(axis=0)) / 2
    eye = centre + size * np.array([1.05, 0.62, 0.55])

    flat = actor(vertices, faces)
    flat.GetProperty().SetInterpolationToFlat()
    flat.GetProperty().SetColor(0.78, 0.81, 0.86)
    flat.GetProperty().EdgeVisibilityOn()
    flat.GetProperty().SetEdgeColor(0.25, 0.28, 0.33)
    points, normals, triangles = patches(surface["control_points"])
    smooth = actor(points, triangles, normals, reflection_lines(points, normals, eye))
    smooth.GetProperty().SetAmbient(0.35)
    smooth.GetProperty().SetDiffuse(0.7)

    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(8)
    window.SetSize(1600, 800)
    for half, shown in enumerate((flat, smooth)):
        renderer = vtk.vtkRenderer()
        renderer.SetViewport(half / 2, 0, (half + 1) / 2, 1)
        renderer.SetBackground(1, 1, 1)
        renderer.AddActor(shown)
        camera = renderer.GetActiveCamera()
        camera.SetPosition(*eye)
        camera.SetFocalPoint(*centre)
        camera.SetViewUp(0, 0, 1)
        camera.SetViewAngle(36)
        renderer.ResetCameraClippingRange()
        window.AddRenderer(renderer)
    window.Render()
    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    writer = vtk.vtkPNGWriter()
    writer.SetFileName(target)
    writer.SetInputConnection(grab.GetOutputPort())
    writer.Write()


if __name__ == "__main__":
    main(*sys.argv[1:])
