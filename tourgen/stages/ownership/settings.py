"""What the search for grids looks for."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Settings:
    """What to look for.

    Attributes:
        step_deg: Finest and coarsest step of a scanner's grid.
        windows_deg: Edges of the windows whose points are compared. A window of some 20 steps
            forgives a place that is some centimetres off, a wider one tells it better: each edge
            is tried in turn for the frequency, then those before it for the place.
        windows: Number of windows.
        window_points: Points taken from a window.
        rise_m: How far above or below the place given a station may have stood.
        least_answer: Windows of random points answer 1 on average; a grid answers this at least.
        clear_answer: No narrower windows are tried where they answer this.
        least_agreement: Mean cosine of all phases over that which random points reach.
        most_off: A point farther off the grid than this, in steps, is not the station's.
        least_matched: Least share of the points that must lie on a grid.
        least_share: Least share of the points on one station's grid, a quarter of ``most_off``
            off: by chance 0.0013 are. In the demo's rooms the stations had 0.066 to 0.34, places
            where nobody stood up to 0.0054.
        polish_points: Points of the cloud drawn for the last fit.
    """

    step_deg: tuple[float, float] = (0.02, 2.0)
    windows_deg: tuple[float, ...] = (5.0, 1.6, 0.5)
    windows: int = 150
    window_points: int = 100
    rise_m: float = 0.16
    least_answer: float = 2.0
    clear_answer: float = 10.0
    least_agreement: float = 5.0
    most_off: float = 0.08
    least_matched: float = 0.9
    least_share: float = 0.015
    polish_points: int = 100_000
