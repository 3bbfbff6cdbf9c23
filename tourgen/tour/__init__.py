"""The tour file: what it may say, how it is read, and what its scans say of themselves."""

from tourgen.tour.file import check_tour, load_tour
from tourgen.tour.scans import check_scans, open_scans
from tourgen.tour.tables import (
    TOUR_FILE,
    UNITS,
    Box,
    Clean,
    Kiosk,
    Link,
    Note,
    Place,
    Room,
    ScanRef,
    Stop,
    Surface,
    Texture,
    Tour,
    TourHead,
    Viewpoint,
)

__all__ = [
    "TOUR_FILE",
    "UNITS",
    "Box",
    "Clean",
    "Kiosk",
    "Link",
    "Note",
    "Place",
    "Room",
    "ScanRef",
    "Stop",
    "Surface",
    "Texture",
    "Tour",
    "TourHead",
    "Viewpoint",
    "check_scans",
    "check_tour",
    "load_tour",
    "open_scans",
]
