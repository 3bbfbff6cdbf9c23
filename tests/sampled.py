"""Points spread over known shapes, for the tests of the surface methods."""

from __future__ import annotations

import numpy as np
from surfaces import oriented

from tourgen.geometry import Float64, Mesh, OrientedCloud
from tourgen.stages.mesh_arrays import edges


def cloud(points: object, normals: object) -> OrientedCloud:
    at = np.asarray(points, np.float32)
    return oriented(at, normals, np.full(at.shape, 128, np.uint8))


def sphere(count: int, radius_m: float = 1.0, noise_m: float = 0.0, seed: int = 0) -> OrientedCloud:
    """Even points on a sphere seen from outside (Fibonacci's lattice, a little shaken)."""
    rng = np.random.default_rng(seed)
    height = 1 - 2 * (np.arange(count) + 0.5) / count
    turn = np.pi * (1 + np.sqrt(5)) * np.arange(count)
    ring = np.sqrt(1 - height**2)
    normals = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)
    normals += rng.normal(0, 0.1 * np.sqrt(4 * np.pi / count), normals.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return cloud(normals * (radius_m + rng.normal(0, noise_m, (count, 1))), normals)


def torus(around: int, across: int, seed: int = 0) -> OrientedCloud:
    """A ring of radius 1 m and thickness 0.4 m, seen from outside."""
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(np.arange(around), np.arange(across), indexing="ij"), -1)
    shaken = grid.reshape(-1, 2) + rng.uniform(-0.2, 0.2, (around * across, 2))
    shaken[:, 0] += 0.5 * (grid.reshape(-1, 2)[:, 1] % 2)
    u, v = (2 * np.pi * shaken / [around, across]).T
    normals = np.stack([np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)], axis=1)
    middle = np.stack([np.cos(u), np.sin(u), np.zeros_like(u)], axis=1)
    return cloud(middle + 0.4 * normals, normals)


def flat(
    count: int, width_m: float = 1.0, noise_m: float = 0.0, seed: int = 0, tilt_deg: float = 0.0
) -> OrientedCloud:
    """A square sheet in z = 0 that looks up, points on a shaken lattice; normals off by a tilt."""
    rng = np.random.default_rng(seed)
    side = round(np.sqrt(count))
    grid = np.stack(np.meshgrid(np.arange(side), np.arange(side)), -1).reshape(-1, 2)
    places = (grid + rng.uniform(0.2, 0.8, grid.shape)) * width_m / side
    normals = np.column_stack(
        [np.tan(np.radians(rng.normal(0, tilt_deg, grid.shape))), places[:, 0]]
    )
    normals[:, 2] = 1
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return cloud(np.column_stack([places, rng.normal(0, noise_m, len(grid))]), normals)


def box_corner(cells: int, noise_m: float = 0.0, seed: int = 0) -> OrientedCloud:
    """Three square metres that meet in the origin, seen from within the corner."""
    sheet = flat(cells * cells, 1.0, noise_m, seed)
    points, normals = sheet.cloud.points, sheet.normals
    turns = [np.roll(np.arange(3), axis) for axis in range(3)]
    return cloud(
        np.concatenate([points[:, turn] for turn in turns]),
        np.concatenate([normals[:, turn] for turn in turns]),
    )


def moved(given: OrientedCloud, rotation: Float64, shift: Float64) -> OrientedCloud:
    return cloud(
        given.cloud.points @ rotation.T + shift, np.asarray(given.normals @ rotation.T, np.float32)
    )


def volume_m3(mesh: Mesh) -> float:
    """What a closed mesh holds; negative where its faces look inward."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(np.float64) for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def faces_per_edge(mesh: Mesh) -> np.ndarray:
    """How many faces share each edge, in an order of no meaning."""
    edge = np.sort(edges(mesh.faces), axis=1)
    return np.unique(edge, axis=0, return_counts=True)[1]


def borders(mesh: Mesh) -> np.ndarray:
    """(b, 2) the edges that only one face has."""
    edge, count = np.unique(np.sort(edges(mesh.faces), axis=1), axis=0, return_counts=True)
    return np.asarray(edge[count == 1])


def euler_characteristic(mesh: Mesh) -> int:
    return len(np.unique(mesh.faces)) - len(faces_per_edge(mesh)) + len(mesh.faces)


def runs_one_way(mesh: Mesh) -> bool:
    """Whether no two faces run along an edge in the same direction."""
    return len(np.unique(edges(mesh.faces), axis=0)) == 3 * len(mesh.faces)
