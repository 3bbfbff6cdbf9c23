"""Whether a visitor 1.5 m in front of a plaque can tell the squares of its boards apart.

The boards are laid out as ``tourgen.simulation.materials.plaque`` paints them. A square's value
is the mean luminance of its middle half in the screenshot; squares are called black or white by
a threshold half-way between the board's darkest and brightest quarter, which knows nothing of
the pattern. The contrast is the mean difference between neighbours, white less black, over that
of the truth drawn from the same camera.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from drawing import SIZE, Camera

from tourgen.geometry import Float64, UInt8
from tourgen.simulate import MODELS
from tourgen.simulation.materials import PLAQUE_SIZE

DISTANCE_M = 1.5
PIXELS_PER_M = 2000
MARGIN_PX, GAP_PX, BOTTOM_PX = 60, 40, 50
TITLE_PX = (118, 62, 40, 26)
"""Heights of the lines above the boards."""
SHARES = (0.5, 0.28, 0.14)
EDGES_MM = {"chamber1": (40, 20, 10), "chamber2": (20, 10, 5)}
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@dataclass(frozen=True)
class Board:
    """A checkerboard.

    Attributes:
        edge_mm: Of its squares.
        middles: (r, c, 3) of its squares, metres.
        right, up: (3,) metres along half an edge.
        white: (r, c) its pattern.
    """

    edge_mm: int
    middles: Float64
    right: Float64
    up: Float64
    white: npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Reading:
    """How well a board is read.

    Attributes:
        right: Share of squares called by their colour.
        contrast: Between neighbours, over the truth's.
    """

    right: float
    contrast: float


def plaque_view(room: str) -> tuple[Camera, tuple[Board, ...]]:
    """The camera in front of a room's plaque, and its boards."""
    corner, right, up = _plate(room)
    width, height = (int(edge * PIXELS_PER_M) for edge in PLAQUE_SIZE)
    middle = corner + (right * PLAQUE_SIZE[0] + up * PLAQUE_SIZE[1]) / 2
    camera = Camera(middle + DISTANCE_M * np.cross(right, up), middle)
    top = 36 + sum(int(line * 1.22) for line in TITLE_PX)
    bottom, left = height - BOTTOM_PX, MARGIN_PX
    boards = []
    for edge_mm, share in zip(EDGES_MM[room], SHARES, strict=True):
        step = edge_mm * PIXELS_PER_M // 1000
        columns = max(2, int((width - 160) * share) // step)
        rows = max(2, (bottom - top - 20) // step)
        x = (left + (np.arange(columns) + 0.5) * step) / PIXELS_PER_M
        y = (height - bottom + (np.arange(rows) + 0.5) * step) / PIXELS_PER_M
        middles = corner + x[None, :, None] * right + y[:, None, None] * up
        white = (np.arange(rows)[:, None] + np.arange(columns)) % 2 == 0
        half_m = edge_mm / 2000
        boards.append(Board(edge_mm, middles, half_m * right, half_m * up, white))
        left += columns * step + GAP_PX
    return camera, tuple(boards)


def _plate(room: str) -> tuple[Float64, Float64, Float64]:
    """The lower left corner of a room's plaque and its directions right and up."""
    for part in MODELS[room]().charts:
        grid = part.points
        width = np.linalg.norm(grid[0, -1] - grid[0, 0])
        height = np.linalg.norm(grid[-1, 0] - grid[0, 0])
        if part.material.texel == 0.25 and np.allclose((width, height), PLAQUE_SIZE, atol=1e-6):
            return (
                grid[0, 0],
                (grid[0, -1] - grid[0, 0]) / width,
                (grid[-1, 0] - grid[0, 0]) / height,
            )
    raise LookupError(f"{room}: found no plaque")


def read_board(picture: UInt8, truth: UInt8, camera: Camera, board: Board) -> Reading:
    """How well a board is read in a picture.

    Args:
        picture: (h, w, 3) as the camera sees the published room.
        truth: (h, w, 3) as it sees the true one.
        camera: In front of the plaque.
        board: On it.
    """
    values, true = _values(picture, camera, board), _values(truth, camera, board)
    dark, bright = np.quantile(values, [0.125, 0.875])
    called = values > (dark + bright) / 2
    return Reading(
        float((called == board.white).mean()), _contrast(values, board) / _contrast(true, board)
    )


def _values(picture: UInt8, camera: Camera, board: Board) -> Float64:
    """(r, c) mean luminance of the middle half of each square."""
    from scipy.ndimage import map_coordinates

    shares = np.linspace(-0.5, 0.5, 5)
    at = (
        board.middles[:, :, None, None]
        + shares[:, None, None] * board.right
        + shares[None, :, None] * board.up
    )
    luminance = picture @ _LUMINANCE
    sampled = map_coordinates(luminance, projected(camera, at), order=1, mode="nearest")
    values: Float64 = sampled.mean(axis=(2, 3))
    return values


def projected(camera: Camera, places: Float64) -> Float64:
    """(2, ...) row and column of places (..., 3) in a camera's picture."""
    width, height = SIZE
    corner = camera.rays(SIZE)[..., 3:].astype(np.float64)
    origin = corner[0, 0]
    right = (corner[0, -1] - origin) / (width - 1)
    down = (corner[-1, 0] - origin) / (height - 1)
    solved = np.linalg.solve(
        np.stack([right, down, origin], axis=1), (places - camera.position).reshape(-1, 3).T
    )
    column, row = solved[0] / solved[2], solved[1] / solved[2]
    return np.stack([row, column]).reshape(2, *places.shape[:-1])


def _contrast(values: Float64, board: Board) -> float:
    sign = np.where(board.white, 1, -1)
    across = (values[:, 1:] - values[:, :-1]) * sign[:, 1:]
    along = (values[1:] - values[:-1]) * sign[1:]
    return float(np.concatenate([across.ravel(), along.ravel()]).mean())
