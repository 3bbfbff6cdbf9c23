"""The best that our texture can be: the same points with clean colours, on the true mesh.

Every point that truly hit the room's surface is put at its true place and takes the true colour
there; mixed pixels, strays, reflections and the passer-by are gone. The room is then built with
``room.mesh`` set to the true surface, so that levels, tiles, texture and packing are the
pipeline's own.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
from drawing import blended, tensor
from rooms import BenchRoom, read_scan
from true_picture import TexturedTruth
from variants import built

from tourgen.simulation.atlas import sample
from tourgen.simulation.output import write_ply

SURFACE = 0
NAME = "oracle"


def oracle_tour(tour: Path, room: BenchRoom, truth: TexturedTruth, scratch: Path) -> Path:
    """A tour's folder with one room, its clean scan and its true mesh."""
    import open3d as o3d

    folder = scratch / NAME / room.id
    cloud = folder / "scans" / "clean.ply"
    if not cloud.exists():
        cloud.parent.mkdir(parents=True, exist_ok=True)
        write_clean(cloud, room, truth)
        mesh = o3d.geometry.TriangleMesh(
            o3d.utility.Vector3dVector(truth.vertices), o3d.utility.Vector3iVector(truth.faces)
        )
        mesh.remove_duplicated_vertices()
        mesh.remove_degenerate_triangles()
        o3d.io.write_triangle_mesh(str(folder / "scans" / "true.ply"), mesh)
    told = (tour / "tour.toml").read_text(encoding="utf-8")
    (folder / "tour.toml").write_text(_clean(told, room), encoding="utf-8")
    return folder


def write_clean(file: Path, room: BenchRoom, truth: TexturedTruth) -> None:
    """The points of a scan that hit the surface, where they hit it, in its colours."""
    points, _ = read_scan(room.scan)
    label = np.load(room.truth_folder / f"{room.id}.npz")["label"]
    nearest = truth.scene.compute_closest_points(tensor(points[label == SURFACE]))
    face = nearest["primitive_ids"].numpy().astype(np.int64)
    at = blended(truth.uv[truth.faces[face]], nearest["primitive_uvs"].numpy())
    write_ply(file, nearest["points"].numpy(), sample(truth.texture, at))


def _clean(told: str, room: BenchRoom) -> str:
    """tour.toml of one room: clean scan, true mesh, true stations, no boxes, its own texture."""
    (asked,) = (each for each in tomllib.loads(told)["room"] if each["id"] == room.id)
    texture = ", ".join(f"{key} = {value}" for key, value in asked.get("texture", {}).items())
    return (
        f'[tour]\ntitle = {{ en = "Oracle" }}\nlanguages = ["en"]\nstart = "{room.id}"\n\n'
        f'[[room]]\nid = "{room.id}"\ntitle = {{ en = "Oracle" }}\n'
        'scans = ["scans/clean.ply"]\nmesh = "scans/true.ply"\n'
        f"stations = {np.round(room.stations(), 4).tolist()}\ntexture = {{ {texture} }}\n"
    )


def built_oracle(tour: Path, room: BenchRoom, truth: TexturedTruth, scratch: Path) -> Path | str:
    """The oracle's site; why not, where it cannot be built."""
    return built(oracle_tour(tour, room, truth, scratch), NAME, room.id, scratch, method="")
