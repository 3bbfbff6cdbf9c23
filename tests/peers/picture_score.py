"""How near pictures of a room come to the true ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from true_picture import Shot

from tourgen.geometry import Float64, UInt8


@dataclass(frozen=True)
class PictureScore:
    """The figures of one room's pictures.

    Attributes:
        psnr_db: (n,) one a camera.
        ssim: (n,) one a camera.
        gain: (3,) factor on red, green and blue that suits all pictures best.
    """

    psnr_db: tuple[float, ...]
    ssim: tuple[float, ...]
    gain: tuple[float, ...]


def score_pictures(pictures: Sequence[UInt8], shots: Sequence[Shot]) -> PictureScore:
    """Fit one gain a channel over all pictures, then judge each where it is judged.

    Args:
        pictures: (h, w, 3) each.
        shots: The truth of each.
    """
    gain = fitted_gain(pictures, shots)
    figures = [one_score(p, s, gain) for p, s in zip(pictures, shots, strict=True)]
    return PictureScore(
        tuple(f[0] for f in figures), tuple(f[1] for f in figures), tuple(map(float, gain))
    )


def fitted_gain(pictures: Sequence[UInt8], shots: Sequence[Shot]) -> Float64:
    """(3,) the least squares factor from pictures to truth."""
    both, own = np.zeros(3), np.zeros(3)
    for picture, shot in zip(pictures, shots, strict=True):
        shown = picture[shot.judged].astype(np.float64)
        both += (shown * shot.picture[shot.judged]).sum(axis=0)
        own += (shown**2).sum(axis=0)
    gain: Float64 = both / np.maximum(own, 1)
    return gain


def corrected(picture: UInt8, gain: Float64) -> Float64:
    """(h, w, 3) a picture after its gain, 0 to 255."""
    values: Float64 = np.clip(picture * gain, 0, 255)
    return values


def one_score(picture: UInt8, shot: Shot, gain: Float64) -> tuple[float, float]:
    """PSNR, decibels, and SSIM of one picture.

    SSIM is taken in windows (Wang, Bovik, Sheikh, Simoncelli 2004: Gaussian, 1.5 pixels wide);
    those whose middle is not judged do not count, and in those at the rim what is masked is
    equal in both.
    """
    from skimage.metrics import structural_similarity

    shown, true = corrected(picture, gain), shot.picture.astype(np.float64)
    error = ((shown - true)[shot.judged] ** 2).mean()
    shown = np.where(shot.judged[..., None], shown, true)
    _, similar = structural_similarity(
        true,
        shown,
        data_range=255,
        channel_axis=2,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
        full=True,
    )
    return float(10 * np.log10(255**2 / error)), float(similar[shot.judged].mean())
