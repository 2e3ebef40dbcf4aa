"""Proves that numpy opens the npz and that neighbouring nets carry the same bits along edges."""

import numpy as np

from surface import boundary, check, surfaces

for surface in surfaces():
    name = surface.path.name
    n_faces = len(surface.faces)
    degree = surface.degree
    check(degree == (6 if "sextic" in name else 7), f"{name}: degree {degree}")
    check(surface.vertices.shape[1:] == (3,), f"{name}: vertices {surface.vertices.shape}")
    check(surface.nets.shape == (n_faces, (degree + 1) * (degree + 2) // 2, 3), f"{name}: nets {surface.nets.shape}")
    check(np.isfinite(surface.nets).all(), f"{name}: a control point is not finite")
    bits = surface.nets.view(np.uint64)
    rows = [boundary(corner, degree) for corner in range(3)]
    half_edges = surface.half_edges()
    for (a, b), (f, corner) in half_edges.items():
        check((b, a) in half_edges, f"{name}: edge {(a, b)} has one face")
        g, other = half_edges[b, a]
        agree = np.array_equal(bits[f, rows[corner]], bits[g, rows[other]][::-1])
        check(agree, f"{name}: faces {f} and {g} differ along edge {(a, b)}")
        at_vertex = surface.vertices[a].view(np.uint64)
        check(np.array_equal(bits[f, rows[corner][0]], at_vertex), f"{name}: corner of {f}")
    print(f"numpy: {name}: {n_faces} faces of degree {degree}, {len(half_edges) // 2} edges agree in all bits")
