"""Proves that gmsh reads the MSH files and integrates the volume of the patches over them."""

import gmsh
import numpy as np

from surface import check, surfaces

# Order 7 is exact and so is a rule for degree 20, but gmsh inverts monomials to get its basis.
EXACT = 1e-9
TRIANGLE_7, RULE = 43, "Gauss20"

gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
for surface in surfaces():
    path = surface.beside("msh")
    gmsh.clear()
    gmsh.logger.start()
    gmsh.open(str(path))
    errors = [line for line in gmsh.logger.get() if line.startswith(("Error", "Warning"))]
    gmsh.logger.stop()
    check(not errors, f"{path.name}: {errors[:1]}")
    n_faces, n_vertices = len(surface.faces), len(surface.vertices)
    n_nodes = n_vertices + 6 * (3 * n_faces // 2) + 15 * n_faces
    nodes = len(gmsh.model.mesh.getNodes()[0])
    check(nodes == n_nodes, f"{path.name}: {nodes} nodes of {n_nodes}")
    expected = surface.component_volumes()
    entities = gmsh.model.getEntities(2)
    check(len(entities) == len(expected), f"{path.name}: {len(entities)} surfaces")
    solids = gmsh.model.getEntities(3)
    check(len(solids) == sum(v > 0 for v in expected), f"{path.name}: {len(solids)} volumes")
    local, weights = gmsh.model.mesh.getIntegrationPoints(TRIANGLE_7, RULE)
    volumes = []
    for _, tag in entities:
        types = gmsh.model.mesh.getElementTypes(2, tag)
        check(list(types) == [TRIANGLE_7], f"{path.name}: element types {types}")
        jacobians, _, at = gmsh.model.mesh.getJacobians(TRIANGLE_7, local, tag)
        columns = jacobians.reshape(-1, 3, 3)
        points = at.reshape(-1, 3)
        normals = np.cross(columns[:, 0], columns[:, 1])
        flux = np.einsum("px,px->p", points - points[0], normals)
        volumes.append(float(flux @ np.tile(weights, len(flux) // len(weights)) / 3))
    # Surfaces stand solid by solid, components in the order of their faces.
    worst = np.abs(np.sort(volumes) - np.sort(expected)).max() / max(expected)
    check(worst <= EXACT, f"{path.name}: gmsh integrates {volumes}, the patches hold {expected}")
    print(
        f"gmsh: {path.name}: {n_faces} triangles of order 7, {nodes} nodes, {len(entities)} surfaces "
        f"of {len(solids)} volumes, volume within {worst:.0e}"
    )
gmsh.finalize()
