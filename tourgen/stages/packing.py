"""Packing: charts that lie flat, laid into one picture by xatlas."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from tourgen.stages.flatten import boxes

if TYPE_CHECKING:
    import numpy.typing as npt

    from tourgen.geometry import Float32, Float64
    from tourgen.stages.charts import Int64

_BORDER: Final = 1  # texels between the charts and the picture's border
_THREADS: Final = Path("/proc/self/task")
_LOOK_S: Final = 1e-4
_UNSEEN_S: Final = 0.01
"""Where a system does not show what its threads do, they have fallen asleep by then."""


def laid_out(flat: Float64, owner: Int64, faces: Int64, padding: int) -> tuple[int, int, Float64]:
    """Width and height of a picture that holds the charts, and (u, 2) where in it they lie.

    Xatlas stretches charts to whole texels, which would change the size of a texel on the
    surface, and begins them amid a texel: so of its coordinates only the place of each chart is
    taken, to whole texels, and a texel more is kept between charts for each of both. It mirrors
    the charts that it rotates, so they are turned before.

    Args:
        flat: (u, 2) texels, each chart from (0, 0).
        owner: (u,) chart of each vertex.
        faces: (f, 3) indices of vertices, -1 for those that no texel could show.
        padding: Texels between two charts.
    """
    # It skips faces without area: for those stands one triangle of a texel, the last chart. Given
    # for each of them, a thousand times the same, it never came to an end.
    spot = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    shown = faces[faces[:, 0] >= 0]
    proxy = np.concatenate([shown, len(flat) + np.arange(3)[None]]) if (faces < 0).any() else shown
    chart = np.append(owner, np.full(3, owner.max()))[proxy[:, 0]]
    size, indices, uvs = _packed(np.concatenate([flat, spot]), proxy, chart, padding)
    low, _ = boxes((uvs.astype(np.float64) * size)[indices].reshape(-1, 2), np.repeat(chart, 3))
    width, height = (-(-(side + 2 * _BORDER) // 4) * 4 for side in size)
    return width, height, flat + (np.round(low - 0.5) + _BORDER)[owner]


def _packed(
    flat: Float64, faces: Int64, chart: Int64, padding: int
) -> tuple[tuple[int, int], npt.NDArray[np.uint32], Float32]:
    """Width and height of xatlas's picture, (f, 3) indices of its vertices, (v, 2) where they lie.

    An atlas has threads, and its end wakes each by one call, without the lock that would make sure
    that it is heard: a thread that has just found nothing to do, and is about to sleep, is waited
    for without end (on busy cores once in fifty thousand atlases, and a room takes hundreds). So
    an atlas ends when its threads sleep.
    """
    import xatlas

    others = _threads()
    atlas = xatlas.Atlas()
    atlas.add_uv_mesh(
        flat.astype(np.float32), faces.astype(np.uint32), chart.astype(np.uint32)[:, None]
    )
    options = xatlas.PackOptions()
    options.texels_per_unit = 1.0
    options.padding = -(-(padding + 2) // 2)  # it is kept about each of two charts
    options.rotate_charts = options.rotate_charts_to_axis = False
    atlas.generate(pack_options=options)
    _, indices, uvs = atlas.get_mesh(0)
    size = (atlas.width, atlas.height)
    await_sleep(_threads() - others)
    return size, indices, uvs


def _threads() -> set[int]:
    """This process's, by the system's numbers; none where it does not show them."""
    return {int(each.name) for each in _THREADS.iterdir()} if _THREADS.exists() else set()


def await_sleep(threads: set[int]) -> None:
    """Return once none of some threads works."""
    if not _THREADS.exists():
        time.sleep(_UNSEEN_S)
    while any(map(_works, threads)):
        time.sleep(_LOOK_S)


def _works(thread: int) -> bool:
    """By its state, the first word after its name (proc_pid_stat(5))."""
    try:
        told = (_THREADS / str(thread) / "stat").read_text("ascii", "replace")
    except OSError:  # it has ended
        return False
    return told.rpartition(")")[2].split()[0] not in "SXZ"
