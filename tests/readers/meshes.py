"""Proves that trimesh finds the GLB, OBJ, PLY and STL closed and of the right topology."""

import json
import struct

import numpy as np
import trimesh

from surface import check, surfaces


def require_closed(name, mesh, surface):
    """Watertight, consistently wound, outward, and with the Euler number of the patches."""
    check(mesh.is_watertight, f"{name}: not watertight")
    check(mesh.is_winding_consistent, f"{name}: winding is not consistent")
    check(mesh.volume > 0, f"{name}: volume {mesh.volume}")
    expected = surface.euler_characteristic()
    check(mesh.euler_number == expected, f"{name}: Euler number {mesh.euler_number}")


def require_gltf(path):
    """The material does not render black; stored normals are unit and look where faces do."""
    data = path.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    tree, binary = json.loads(data[20 : 20 + length]), data[28 + length :]

    def rows(accessor, dtype):
        accessor = tree["accessors"][accessor]
        view = tree["bufferViews"][accessor["bufferView"]]
        flat = np.frombuffer(binary, dtype, view["byteLength"] // 4, view["byteOffset"])
        return flat.reshape(-1, 3)

    (primitive,) = tree["meshes"][0]["primitives"]
    factor = tree["materials"][primitive["material"]]["pbrMetallicRoughness"]["metallicFactor"]
    # A metal without surroundings renders black.
    check(factor == 0, f"{path.name}: metallicFactor {factor}")
    positions = rows(primitive["attributes"]["POSITION"], "<f4").astype(float)
    normals = rows(primitive["attributes"]["NORMAL"], "<f4").astype(float)
    faces = rows(primitive["indices"], "<u4")
    stated = tree["accessors"][primitive["attributes"]["POSITION"]]
    check(np.array_equal(positions.min(axis=0), stated["min"]), f"{path.name}: min")
    check(np.array_equal(positions.max(axis=0), stated["max"]), f"{path.name}: max")
    lengths = np.linalg.norm(normals, axis=1)
    check(np.abs(lengths - 1).max() < 1e-6, f"{path.name}: normals are not of unit length")
    a, b, c = (positions[faces[:, k]] for k in range(3))
    facing = np.einsum("fcx,fx->fc", normals[faces], np.cross(b - a, c - a))
    check((facing > 0).all(), f"{path.name}: {(facing <= 0).sum()} normals look inward")


for surface in surfaces():
    volumes = []
    for extension in ["glb", "obj", "ply", "stl"]:
        path = surface.beside(extension)
        # An STL is a soup by nature; the others must be welded as they are.
        is_soup = extension == "stl"
        mesh = trimesh.load(path, force="mesh", process=is_soup)
        require_closed(path.name, mesh, surface)
        volumes.append(mesh.volume)
    require_gltf(surface.beside("glb"))
    spread = np.ptp(volumes) / volumes[0]
    check(spread < 1e-6, f"{surface.path.stem}: volumes differ by {spread:.1e}")
    exact = trimesh.load(surface.beside("ply"), force="mesh", process=False).vertices
    n_vertices = len(surface.vertices)
    same = np.array_equal(exact[:n_vertices].view("u8"), surface.vertices.view("u8"))
    check(same, f"{surface.path.stem}: vertices of the PLY differ in bits")
    euler = surface.euler_characteristic()
    print(f"trimesh: {surface.path.stem}: glb obj ply stl closed, Euler number {euler}")
