"""The plot of time and memory against points."""

from __future__ import annotations

from pathlib import Path
from typing import Any

_TITLES = {"wall_s": "seconds", "peak_mb": "peak memory, MB"}
_INCHES = (10.0, 4.2)


def plot(rows: list[dict[str, Any]], file: Path) -> None:
    """Draw what each program took, by the number of points, both axes logarithmic.

    A chain counts with the deeper of its two depths, whose cells are no wider than the detail that
    tourgen chose. What did not come to its end has no dot.

    Args:
        rows: Of all sizes, as ``speed`` keeps them.
        file: The picture.
    """
    import matplotlib as mpl

    mpl.use("svg")
    from matplotlib import pyplot as plt

    plt.rcParams |= {"svg.hashsalt": "speed", "font.size": 10}
    figure, panes = plt.subplots(1, len(_TITLES), figsize=_INCHES, layout="constrained")
    for pane, (key, title) in zip(panes, _TITLES.items(), strict=True):
        for program, runs in _series(rows).items():
            points = [each["points"] for each in runs]
            pane.plot(points, [each[key] for each in runs], marker="o", label=program)
        pane.set(xscale="log", yscale="log", xlabel="points", title=title)
        pane.grid(visible=True, which="both", alpha=0.25)
    panes[0].legend()
    figure.savefig(file, metadata={"Date": None})
    plt.close(figure)


def _series(rows: list[dict[str, Any]]) -> dict[str, list[dict[str, Any]]]:
    """The runs of each program, one a size: of a chain the last, at the deeper depth."""
    found: dict[str, dict[int, dict[str, Any]]] = {}
    for row in rows:
        program = str(row["program"]).split(", depth")[0]
        found.setdefault(program, {})[row["points"]] = row
    return {
        program: [by_size[points] for points in sorted(by_size) if not by_size[points]["failed"]]
        for program, by_size in found.items()
    }
