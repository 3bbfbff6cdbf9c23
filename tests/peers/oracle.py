"""The best that our texture can be: the same points with clean colours, on the true mesh.

Every point that truly hit the room's surface is put at its true place and takes the true colour
there; mixed pixels, strays, reflections and the passer-by are gone. The room is then built with
``room.mesh`` set to the true surface, so that levels, tiles, texture and packing are the
pipeline's own. What panoramas can do at their best is found in the same way, from the scan as it
came.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from drawing import blended, tensor
from rooms import BenchRoom, read_scan, stamp
from true_picture import TexturedTruth
from variants import alone, built, link, scanned

from tourgen.simulation.atlas import sample
from tourgen.simulation.output import write_ply
from tourgen.tour import Tour

SURFACE = 0
NAME, PANORAMAS = "oracle", "oracle-panoramas"
_MESH = "true.ply"


def oracle_tour(tour: Tour, room: BenchRoom, truth: TexturedTruth, scratch: Path) -> Tour:
    """One room with its clean scan, true mesh and true stations, without boxes."""
    import open3d as o3d

    folder = scratch / NAME / room.id
    cloud = folder / "scans" / f"clean-{stamp(room.scan)}.ply"
    if not cloud.exists():
        cloud.parent.mkdir(parents=True, exist_ok=True)
        write_clean(cloud, room, truth)
        mesh = o3d.geometry.TriangleMesh(
            o3d.utility.Vector3dVector(truth.vertices), o3d.utility.Vector3iVector(truth.faces)
        )
        mesh.remove_duplicated_vertices()
        mesh.remove_degenerate_triangles()
        o3d.io.write_triangle_mesh(str(folder / "scans" / _MESH), mesh)
    return alone(
        tour,
        room.id,
        folder,
        mesh=f"scans/{_MESH}",
        stations=tuple(map(tuple, np.round(room.stations(), 4).tolist())),
        keep=None,
        remove=(),
        closed=(),
        **scanned(tour, room.id, f"scans/{cloud.name}"),
    )


def write_clean(file: Path, room: BenchRoom, truth: TexturedTruth) -> None:
    """The points of a scan that hit the surface, where they hit it, in its colours."""
    points, _ = read_scan(room.scan)
    label = np.load(room.truth_folder / f"{room.id}.npz")["label"]
    nearest = truth.scene.compute_closest_points(tensor(points[label == SURFACE]))
    face = nearest["primitive_ids"].numpy().astype(np.int64)
    at = blended(truth.uv[truth.faces[face]], nearest["primitive_uvs"].numpy())
    write_ply(file, nearest["points"].numpy(), sample(truth.texture, at))


def built_oracle(tour: Tour, room: BenchRoom, truth: TexturedTruth, scratch: Path) -> Path | str:
    """The oracle's site; why not, where it cannot be built."""
    return built(oracle_tour(tour, room, truth, scratch))


def built_with_panoramas(tour: Tour, room: str, scratch: Path) -> Path | str:
    """The site of a room with the true mesh, made before, in the colours of its E57's panoramas."""
    folder = scratch / PANORAMAS / room
    (folder / "scans").mkdir(parents=True, exist_ok=True)
    scan = f"scans/{room}.e57"
    link(folder / scan, tour.folder / scan)
    link(folder / "scans" / _MESH, scratch / NAME / room / "scans" / _MESH)
    boxes: dict[str, Any] = {"keep": None, "remove": (), "closed": ()}
    variant = alone(tour, room, folder, mesh=f"scans/{_MESH}", **boxes, **scanned(tour, room, scan))
    return built(variant)
