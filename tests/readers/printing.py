"""Proves that lib3mf reads the 3MF files without a warning: closed, oriented, of our volume."""

import lib3mf
import numpy as np

from surface import check, surfaces

# f32 coordinates against the f64 of the PLY: far above rounding, far below a facet.
CHORDS = 0.01

wrapper = lib3mf.get_wrapper()
for surface in surfaces():
    path = surface.beside("3mf")
    model = wrapper.CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(path))
    check(reader.GetWarningCount() == 0, f"{path.name}: {reader.GetWarningCount()} warnings")
    check(model.GetUnit() == lib3mf.ModelUnit.MilliMeter, f"{path.name}: unit {model.GetUnit()}")
    meshes = model.GetMeshObjects()
    check(meshes.MoveNext(), f"{path.name}: no mesh")
    mesh = meshes.GetCurrentMeshObject()
    check(mesh.IsValid() and mesh.IsManifoldAndOriented(), f"{path.name}: not manifold and oriented")
    points = np.array([list(p.Coordinates) for p in mesh.GetVertices()], dtype=float)
    triangles = np.array([list(t.Indices) for t in mesh.GetTriangleIndices()])
    euler = len(points) - len(triangles) // 2
    check(euler == surface.euler_characteristic(), f"{path.name}: Euler number {euler}")
    a, b, c = (points[triangles[:, k]] for k in range(3))
    found = np.einsum("fx,fx->", a, np.cross(b, c)) / 6
    exact = sum(surface.component_volumes())
    off = abs(found - exact) / exact
    check(off < CHORDS, f"{path.name}: the triangles hold {found} of {exact}")
    print(f"lib3mf: {path.name}: {len(triangles)} triangles, manifold and oriented, {off:.0e} off")
