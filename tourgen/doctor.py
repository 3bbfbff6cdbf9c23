"""What this machine lacks, each with the line that mends it.

Runs before anything is installed: it imports the standard library alone, and the Makefile asks
``python3 -m tourgen.doctor [--tests] [--bench]`` which Debian packages to fetch.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

LIBRARIES = {
    "libusb-1.0.so.0": "libusb-1.0-0",
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",
    "libX11.so.6": "libx11-6",
    "libudev.so.1": "libudev1",
    "libgomp.so.1": "libgomp1",
}
"""What ``import open3d`` loads on Linux, and the Debian package of each."""

BENCH_LIBRARIES = {
    "libOpenGL.so.0": "libopengl0",
    "libfontconfig.so.1": "libfontconfig1",
}
"""What ``import pymeshlab`` loads besides, for the benches."""

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
"""Programs that show a tour on a kiosk, and draw it for a film, the best known first."""

TEST_PROGRAMS = {"firefox-esr": "firefox-esr", "Xvfb": "xvfb", "xdotool": "xdotool"}
"""Programs that the tests run beside Chromium, and the Debian package of each: the other browser,
a screen, and hands for the kiosk."""

GIB = 1 << 30
DISK_NEEDED = 2 * GIB
"""Bytes: scans, cache and site of a tour of three rooms."""
MEMORY_NEEDED = 4 * GIB
"""Bytes: surface reconstruction of a room of 6 m at 4 mm."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that this machine lacks.

    Attributes:
        subject: What was looked at.
        fault: What was expected and what was found.
        mend: The line that mends it, to be typed or to be followed.
        package: The Debian package that would bring it, "" where none does.
        optional: Whether a tour is built and served without it.
    """

    subject: str
    fault: str
    mend: str
    package: str = ""
    optional: bool = False


def findings(folder: Path, *, tests: bool = False, bench: bool = False) -> list[Finding]:
    """Look this machine over.

    Args:
        folder: Where the tours are to be built; it must exist.
        tests: Ask also for what the browser tests need.
        bench: Ask also for what the peers of the benches need.

    Returns:
        One finding for each thing lacking; none where all is well.
    """
    found = [*_libraries(LIBRARIES, "Open3D"), *_disk(folder), *_memory()]
    if bench:
        found += _libraries(BENCH_LIBRARIES, "PyMeshLab")
    if browser() is None:
        by = "the browser tests" if tests else "`tourgen kiosk` and `tourgen film` alone"
        fault = f"needed by {by}, not found on the path"
        mend = _install_line("chromium", of="chromium")
        found.append(Finding("chromium", fault, mend, "chromium", optional=not tests))
    if tests:
        found += _programs(TEST_PROGRAMS)
    return found


def browser() -> Path | None:
    """The Chromium of this machine."""
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    return Path(found) if found else None


def _libraries(wanted: Mapping[str, str], by: str) -> Iterator[Finding]:
    if sys.platform != "linux":
        return  # Elsewhere the wheels bring their own.
    for library, package in wanted.items():
        try:
            ctypes.CDLL(library)
        except OSError as error:
            mend = _install_line(package, of=library)
            yield Finding(library, f"needed by {by}, {error}", mend, package)


def _programs(wanted: Mapping[str, str]) -> Iterator[Finding]:
    for program, package in wanted.items():
        if shutil.which(program) is None:
            mend = _install_line(package, of=program)
            yield Finding(program, "needed by the tests, not found on the path", mend, package)


def _install_line(package: str, *, of: str) -> str:
    if shutil.which("apt-get"):
        return f"apt-get install --yes {package}"
    return f"install the package of this system that holds {of}"


def _disk(folder: Path) -> Iterator[Finding]:
    free = shutil.disk_usage(folder).free
    if free < DISK_NEEDED:
        fault = f"expected {_gib(DISK_NEEDED)} free, found {_gib(free)}"
        yield Finding(f"disk of {folder}", fault, "tourgen clean DIR drops the cache of a tour")


def _memory() -> Iterator[Finding]:
    if not hasattr(os, "sysconf"):
        return  # Windows does not tell without a further library.
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if memory < MEMORY_NEEDED:
        fault = f"expected {_gib(MEMORY_NEEDED)}, found {_gib(memory)}"
        yield Finding("memory", fault, "raise `detail_mm` in tour.toml and build with --jobs 1")


def _gib(size: int) -> str:
    return f"{size / GIB:.1f} GiB"


if __name__ == "__main__":
    lacking = findings(Path.cwd(), tests="--tests" in sys.argv, bench="--bench" in sys.argv)
    print(*(finding.package for finding in lacking if finding.package and not finding.optional))
