"""Scans: one file per format, all read into chunks of points."""

from tourgen.scans.mesh import read_mesh
from tourgen.scans.open import FORMATS, open_scan
from tourgen.scans.repeats import without_repeats
from tourgen.scans.room import ReadFacts, read_panoramas, read_room
from tourgen.scans.scan import Chunk, Frame, Scan

__all__ = [
    "FORMATS",
    "Chunk",
    "Frame",
    "ReadFacts",
    "Scan",
    "open_scan",
    "read_mesh",
    "read_panoramas",
    "read_room",
    "without_repeats",
]
