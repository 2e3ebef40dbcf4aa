"""Proves by VTK's own search that patches lie within the stated tolerance of the triangles."""

import numpy as np
from vtkmodules.vtkCommonCore import mutable, vtkIdList
from vtkmodules.vtkCommonDataModel import vtkStaticCellLocator
from vtkmodules.vtkIOPLY import vtkPLYReader

from surface import bernstein, check, surfaces

# What `isospline export` keeps to where it is told nothing else, of the diagonal.
TOLERANCE = 1e-4
STEPS = 12

points = [(i, j, STEPS - i - j) for i in range(STEPS + 1) for j in range(STEPS + 1 - i)]
for surface in surfaces():
    weights = bernstein(np.array(points) / STEPS, surface.degree)
    path = surface.beside("ply")
    reader = vtkPLYReader()
    reader.SetFileName(str(path))
    reader.Update()
    triangles = reader.GetOutput()
    locator = vtkStaticCellLocator()
    locator.SetDataSet(triangles)
    locator.BuildLocator()
    found, cell, sub, distance_sq = [0.0] * 3, mutable(0), mutable(0), mutable(0.0)
    worst = 0.0
    for p in np.einsum("pc,fcx->fpx", weights, surface.nets).reshape(-1, 3):
        locator.FindClosestPoint(p, found, cell, sub, distance_sq)
        worst = max(worst, float(distance_sq))
    diagonal = np.linalg.norm(np.ptp(surface.vertices, axis=0))
    share = np.sqrt(worst) / diagonal
    check(share <= TOLERANCE, f"{path.name}: {share:.2e} of the diagonal off the patches")
    count = triangles.GetNumberOfCells()
    per_patch = count / len(surface.faces)
    print(f"vtk: {path.name}: {count} triangles ({per_patch:.1f} a patch), {share:.1e} off at most")
