"""Proves that gmsh imports the STEP solids and fills them with tetrahedra."""

import gmsh
import numpy as np

from surface import check, surfaces

# Of the volume: chords of an edge a tenth of the model long cut off about this much.
VOLUME = 0.03

gmsh.initialize(interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
for surface in surfaces():
    path = surface.beside("step")
    gmsh.clear()
    gmsh.logger.start()
    gmsh.open(str(path))
    expected = surface.component_volumes()
    solids = gmsh.model.getEntities(3)
    n_solids = sum(v > 0 for v in expected)
    check(len(solids) == n_solids, f"{path.name}: gmsh finds {len(solids)} volumes")
    size = np.ptp(surface.vertices, axis=0).max() / 10
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.model.mesh.generate(3)
    errors = [line for line in gmsh.logger.get() if line.startswith("Error")]
    gmsh.logger.stop()
    check(not errors, f"{path.name}: {errors[:1]}")
    tags, volumes = gmsh.model.mesh.getElementsByType(4)[0], []
    check(len(tags) > 0, f"{path.name}: no tetrahedra")
    volumes = gmsh.model.mesh.getElementQualities(tags, "volume")
    found, ours = volumes.sum(), sum(expected)
    off = abs(found - ours) / ours
    check((volumes > 0).all(), f"{path.name}: {(volumes <= 0).sum()} tetrahedra are inside out")
    check(off <= VOLUME, f"{path.name}: tetrahedra fill {found} of {ours}")
    print(f"gmsh: {path.name}: {n_solids} volumes, {len(tags)} tetrahedra, volume within {off:.0e}")
gmsh.finalize()
