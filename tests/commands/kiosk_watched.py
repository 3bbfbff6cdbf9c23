"""`tourgen kiosk` with a door for the tests to look in by: ``kiosk_watched.py SITE PORT DOOR``."""

from __future__ import annotations

import sys
from pathlib import Path

from tourgen.errors import TourgenError
from tourgen.kiosk import run_kiosk, screen

if __name__ == "__main__":
    screen.SWITCHES = (*screen.SWITCHES, f"--remote-debugging-port={sys.argv[3]}")
    try:
        run_kiosk(Path(sys.argv[1]), int(sys.argv[2]), lambda line: print(line, flush=True))
    except TourgenError as error:
        sys.exit(f"error: {error.message}")
