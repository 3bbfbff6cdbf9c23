"""Soft light for the model: daylight and lamps with shadows, then bounces between all vertices.

Radiosity gathered with cosine-weighted rays (Cohen and Wallace, "Radiosity and Realistic Image
Synthesis", 1993): every vertex remembers what its rays hit, so that a bounce is one look-up.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.ndimage import distance_transform_edt

from tourgen.geometry import Float32, Float64
from tourgen.rays import ray_scene, rays_of
from tourgen.simulation.charts import Bools, Chart
from tourgen.simulation.model import ChartMesh, Lamp, PlacedOpening

RAYS = 64
BOUNCES = 5
PANE_SAMPLES = 9
LAMP_SAMPLES = 3
WHITE_BALANCE = 0.8  # share of the room's own tint that the camera takes out
# Radiance of what is seen through an opening; a door shows the next, dimmer room.
SKY = {
    "window": np.array([1.0, 1.04, 1.10]),
    "porthole": np.array([1.0, 1.04, 1.10]) * 1.5,
    "door": np.array([0.42, 0.34, 0.25]),
}
SUN = np.array([9.0, 7.4, 5.2])


def illuminate(
    charts: Sequence[Chart],
    mesh: ChartMesh,
    albedo: Float32,
    openings: Sequence[PlacedOpening],
    lamps: Sequence[Lamp],
    sun: Float64,
    seed: int,
) -> Float32:
    """Light that falls on every vertex.

    Args:
        charts: The surfaces.
        mesh: The same, joined.
        albedo: (v, 3) linear.
        openings: Where daylight enters.
        lamps: Lights within.
        sun: (3,) unit vector towards the sun.
        seed: Of the rays' directions.

    Returns:
        (v, 3) float32, scaled so that its geometric mean is about 1.
    """
    rng = np.random.default_rng(seed)
    scene = ray_scene(mesh.vertices, mesh.faces)
    at = mesh.inner + 0.004 * mesh.normals
    hits, valid = _gather(scene, mesh, at, rng)
    direct = _daylight(scene, mesh, at, openings, rng)
    direct += _lamplight(scene, mesh, at, lamps, rng)
    direct += _sunlight(scene, mesh, at, openings, sun, rng)
    direct[~valid] = 0
    glow = np.repeat([part.material.glow for part in charts], np.diff(mesh.first))
    seen = np.maximum(hits, 0)
    light = direct
    for _ in range(BOUNCES):
        sent = (albedo * light + 0.15 * glow[:, None]).astype(np.float32)
        total = np.zeros_like(light)
        for k in range(RAYS):
            total += np.where(hits[:, k, None] >= 0, sent[seen[:, k]], 0)
        light = direct + total / RAYS
        light[~valid] = 0
    level = np.exp(np.log(light[valid] + 1e-4).mean(axis=0))
    level = level**WHITE_BALANCE * float(level.mean()) ** (1 - WHITE_BALANCE)
    return _filled(charts, mesh, light / level, valid)


def _gather(
    scene: Any, mesh: ChartMesh, at: Float64, rng: np.random.Generator
) -> tuple[Any, Bools]:
    """Per vertex: the vertices that its rays hit (-1: none), and whether it is in the open."""
    side = np.cross(
        mesh.normals, np.where(np.abs(mesh.normals[:, :1]) < 0.8, [1.0, 0, 0], [0, 1.0, 0])
    )
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-9)
    other = np.cross(mesh.normals, side)
    spin = rng.random(len(at)) * 2 * np.pi
    hits = np.full((len(at), RAYS), -1, dtype=np.int32)
    behind = np.zeros(len(at))
    corners = mesh.faces
    for k in range(RAYS):
        lean = np.sqrt((k + 0.5) / RAYS)
        turn = spin + k * 2.399963
        direction = (
            lean * np.cos(turn)[:, None] * side
            + lean * np.sin(turn)[:, None] * other
            + np.sqrt(1 - lean * lean) * mesh.normals
        )
        answer = scene.cast_rays(rays_of(at, direction))
        face = answer["primitive_ids"].numpy().astype(np.int64)
        found = np.isfinite(answer["t_hit"].numpy())
        normal = answer["primitive_normals"].numpy()
        back = found & ((normal * direction).sum(axis=1) > 0)
        behind += back
        uv = answer["primitive_uvs"].numpy()
        weights = np.stack([1 - uv.sum(axis=1), uv[:, 0], uv[:, 1]], axis=1)
        nearest = corners[np.where(found, face, 0), weights.argmax(axis=1)]
        hits[:, k] = np.where(found & ~back, nearest, -1)
    return hits, behind < 0.2 * RAYS


def _shadow(scene: Any, at: Float64, to: Float64) -> Bools:
    """Whether the way from each point to its target is free."""
    way = to - at
    length = np.linalg.norm(way, axis=1)
    direction = way / np.maximum(length, 1e-9)[:, None]
    reach = scene.cast_rays(rays_of(at, direction))["t_hit"].numpy()
    free: Bools = reach > length - 0.002
    return free


def _daylight(
    scene: Any,
    mesh: ChartMesh,
    at: Float64,
    openings: Sequence[PlacedOpening],
    rng: np.random.Generator,
) -> Float64:
    light = np.zeros((len(at), 3))
    for place in openings:
        facing = ((place.center - at) * mesh.normals).sum(axis=1) > -0.7
        rows = np.nonzero(facing)[0]
        area = (
            place.opening.width * place.opening.height * (np.pi / 4 if place.opening.round else 1)
        )
        for k in range(PANE_SAMPLES):
            a = (k + rng.random(len(rows))) / PANE_SAMPLES * 2 - 1
            b = rng.random(len(rows)) * 2 - 1
            if place.opening.round:
                radius, turn = np.sqrt((a + 1) / 2), b * np.pi
                a, b = radius * np.cos(turn), radius * np.sin(turn)
            target = (
                place.center
                + a[:, None] * place.right * place.opening.width / 2
                + b[:, None] * place.up * place.opening.height / 2
            )
            way = target - at[rows]
            square = np.maximum((way * way).sum(axis=1), 0.01)
            length = np.sqrt(square)
            here = (way * mesh.normals[rows]).sum(axis=1) / length
            there = (way * place.outward).sum(axis=1) / length
            strength = (
                np.clip(here, 0, None) * np.clip(there, 0, None) * area / square / PANE_SAMPLES
            )
            strength = np.where(_shadow(scene, at[rows], target), strength, 0)
            light[rows] += strength[:, None] * SKY[place.opening.kind]
    return light


def _lamplight(
    scene: Any, mesh: ChartMesh, at: Float64, lamps: Sequence[Lamp], rng: np.random.Generator
) -> Float64:
    light = np.zeros((len(at), 3))
    for lamp in lamps:
        for _ in range(LAMP_SAMPLES):
            ball = rng.normal(size=(len(at), 3))
            ball /= np.linalg.norm(ball, axis=1, keepdims=True)
            away = at - np.asarray(lamp.position)
            ball = np.where((ball * away).sum(axis=1, keepdims=True) < 0, -ball, ball)
            target = np.asarray(lamp.position) + ball * (lamp.radius_m + 0.01)
            way = target - at
            square = np.maximum((way * way).sum(axis=1), 0.02)
            here = np.clip((way * mesh.normals).sum(axis=1), 0, None) / np.sqrt(square)
            strength = np.where(_shadow(scene, at, target), here / square, 0) / LAMP_SAMPLES
            light += strength[:, None] * np.asarray(lamp.power)
    return light


def _sunlight(
    scene: Any,
    mesh: ChartMesh,
    at: Float64,
    openings: Sequence[PlacedOpening],
    sun: Float64,
    rng: np.random.Generator,
) -> Float64:
    light = np.zeros((len(at), 3))
    rows = np.nonzero((mesh.normals * sun).sum(axis=1) > 0.02)[0]
    for _ in range(8):
        direction = sun + rng.normal(scale=0.012, size=(len(rows), 3))
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        free = np.zeros(len(rows), dtype=np.bool_)
        for place in openings:
            if place.opening.glazed:
                free |= place.leaves(at[rows], direction)
        way = np.nonzero(free)[0]
        reach = scene.cast_rays(rays_of(at[rows[way]], direction[way]))["t_hit"].numpy()
        way = way[~np.isfinite(reach)]
        here = (mesh.normals[rows[way]] * direction[way]).sum(axis=1)
        light[rows[way]] += here[:, None] * SUN / 8
    return light


def _filled(charts: Sequence[Chart], mesh: ChartMesh, light: Float64, valid: Bools) -> Float32:
    """Smoothed light; vertices inside other things take it from the nearest open one."""
    out = light.astype(np.float32)
    for k, part in enumerate(charts):
        span = slice(mesh.first[k], mesh.first[k + 1])
        shape = part.points.shape[:2]
        open_ = valid[span].reshape(shape)
        grid = out[span].reshape(*shape, 3)
        if not open_.any():
            continue
        if not open_.all():
            i, j = distance_transform_edt(~open_, return_distances=False, return_indices=True)
            grid = grid[i, j]
        grid = _smooth(_smooth(grid))
        if np.allclose(part.points[:, 0], part.points[:, -1]):
            grid[:, 0] = grid[:, -1] = (grid[:, 1] + grid[:, -2]) / 2
        out[span] = grid.reshape(-1, 3)
    return out


def _smooth(grid: Float32) -> Float32:
    """A [1 2 1] blur along both axes, borders kept."""
    for axis in (0, 1):
        if grid.shape[axis] < 3:
            continue
        moved = np.moveaxis(grid, axis, 0)
        inner = (moved[:-2] + 2 * moved[1:-1] + moved[2:]) / 4
        grid = np.moveaxis(np.concatenate([moved[:1], inner, moved[-1:]]), 0, axis)
    return grid
