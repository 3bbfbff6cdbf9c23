"""The sea below the lighthouse: noise that swells and breaks, as a sound file."""

from __future__ import annotations

import io
import wave

import numpy as np
from scipy.signal import butter, sosfilt

RATE_HZ = 22_050
_SECONDS = 10.0
_SWELLS_S = (3.1, 5.3)
"""Time between waves, of two trains of them."""
_DEEP_HZ, _SPRAY_HZ = 300.0, 1800.0
_FADE_S = 0.4


def sea(seed: int = 7) -> bytes:
    """Ten seconds of it, a WAV file of one channel."""
    rng = np.random.default_rng(seed)
    time = np.arange(int(_SECONDS * RATE_HZ)) / RATE_HZ
    noise = rng.normal(0, 1, len(time))
    deep = sosfilt(butter(2, _DEEP_HZ, fs=RATE_HZ, output="sos"), noise)
    spray = sosfilt(butter(2, _SPRAY_HZ, "highpass", fs=RATE_HZ, output="sos"), noise)
    swell = np.mean([(0.5 - 0.5 * np.cos(2 * np.pi * time / every)) for every in _SWELLS_S], axis=0)
    sound = deep / deep.std() * (0.3 + 0.7 * swell) + 0.35 * spray / spray.std() * swell**3
    sound *= np.clip(np.minimum(time, time[-1] - time) / _FADE_S, 0, 1)
    samples = np.round(sound / np.abs(sound).max() * 0.7 * 32767).astype("<i2")
    file = io.BytesIO()
    with wave.open(file, "wb") as out:
        out.setnchannels(1)
        out.setsampwidth(2)
        out.setframerate(RATE_HZ)
        out.writeframes(samples.tobytes())
    return file.getvalue()
