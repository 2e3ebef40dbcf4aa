"""Proves that VTK reads the Bezier cells of the VTU and evaluates them to our own values."""

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import reference
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

from surface import bernstein, check, surfaces

VTK_BEZIER_TRIANGLE = 76
TOLERANCE = 1e-12
# Corners, edge points and inner points, none of them symmetric under exchange of coordinates.
POINTS = np.array(
    [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.7, 0.3, 0], [0, 0.2, 0.8], [0.45, 0, 0.55],
     [0.2, 0.3, 0.5], [0.61, 0.28, 0.11], [0.05, 0.15, 0.8]]
)

for surface in surfaces():
    path = surface.beside("vtu")
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    check(reader.GetErrorCode() == 0, f"{path.name}: VTK error {reader.GetErrorCode()}")
    grid = reader.GetOutput()
    n_faces, n_vertices = len(surface.faces), len(surface.vertices)
    check(grid.GetNumberOfCells() == n_faces, f"{path.name}: {grid.GetNumberOfCells()} cells")
    degree = surface.degree
    inside = (degree - 1) * (degree - 2) // 2
    n_points = n_vertices + (degree - 1) * (3 * n_faces // 2) + inside * n_faces
    check(grid.GetNumberOfPoints() == n_points, f"{path.name}: points along edges are not shared")
    points = vtk_to_numpy(grid.GetPoints().GetData())
    scale = np.ptp(surface.vertices, axis=0).max()
    weights = bernstein(POINTS, degree)
    n_control = weights.shape[1]
    worst, weight_of, sub_id = 0.0, [0.0] * n_control, reference(0)
    for f in range(n_faces):
        cell = grid.GetCell(f)
        check(cell.GetCellType() == VTK_BEZIER_TRIANGLE, f"{path.name}: cell {f} has another type")
        check(cell.GetNumberOfPoints() == n_control, f"{path.name}: cell {f} has another degree")
        ids = [cell.GetPointId(q) for q in range(n_control)]
        ours = surface.nets[f]
        same = np.array_equal(np.sort(points[ids].view("u8"), axis=0), np.sort(ours.view("u8"), axis=0))
        check(same, f"{path.name}: control points of face {f} differ in bits")
        for (_, v, w), expected in zip(POINTS, weights @ ours):
            found = [0.0, 0.0, 0.0]
            cell.EvaluateLocation(sub_id, [v, w, 0.0], found, weight_of)
            worst = max(worst, np.abs(np.array(found) - expected).max() / scale)
    check(worst <= TOLERANCE, f"{path.name}: VTK evaluates {worst:.1e} off")
    print(f"vtk: {path.name}: {n_faces} cells, {len(POINTS)} points each, at most {worst:.1e} off")
