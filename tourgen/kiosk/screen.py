"""The screen: Chromium over all of it, with the ways out shut that a page cannot shut itself."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Final

from PIL import ImageGrab

SWITCHES: tuple[str, ...] = (
    "--kiosk",
    "--no-first-run",
    "--no-default-browser-check",
    "--noerrdialogs",
    "--hide-crash-restore-bubble",
    "--disable-session-crashed-bubble",
    "--disable-pinch",
    "--overscroll-history-navigation=0",
    "--disable-features=Translate,GlobalMediaControls,MediaRouter",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-breakpad",
    "--disable-print-preview",
    "--password-store=basic",
    "--autoplay-policy=no-user-gesture-required",
    "--enable-unsafe-swiftshader",  # without a graphics card the tour is slow, not absent
)
"""Of Chromium. An app's window hands every key to the page first, which refuses most."""

_AS_ROOT: Final = ("--no-sandbox", "--test-type")
"""Chromium refuses root its sandbox; the second keeps it from saying so on the screen."""


def start_browser(program: Path, profile: Path, address: str) -> subprocess.Popen[bytes]:
    """Start it in a group of its own."""
    root = _AS_ROOT if hasattr(os, "geteuid") and os.geteuid() == 0 else ()
    return subprocess.Popen(
        [program, *SWITCHES, *_whole(), *root, f"--user-data-dir={profile}", f"--app={address}"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


def stop_browser(browser: subprocess.Popen[bytes]) -> None:
    """End it and all of its processes."""
    if sys.platform == "win32":
        tree = ["taskkill", "/F", "/T", "/PID", str(browser.pid)]
        subprocess.run(tree, check=False, capture_output=True)
    else:
        with suppress(ProcessLookupError):
            os.killpg(browser.pid, signal.SIGKILL)
    browser.wait()


def end_leftovers(profile: Path) -> None:
    """End the browser of a kiosk that was killed: it would open the next one's page beside its own.

    Only Linux tells; elsewhere it is to be closed by hand.
    """
    mark = f"--user-data-dir={profile}".encode()
    for words in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):  # it has ended meanwhile
            if mark in words.read_bytes():
                os.kill(int(words.parent.name), signal.SIGKILL)


def _whole() -> tuple[str, ...]:
    """A size that covers the screen: without a window manager no window fills it by itself.

    Of a window as large as the screen Chromium takes a pixel off.
    """
    if sys.platform != "linux" or not os.environ.get("DISPLAY"):
        return ()
    try:
        width, height = ImageGrab.grab(xdisplay="").size
    except OSError:
        return ()
    return "--window-position=0,0", f"--window-size={width + 1},{height + 1}"


def has_screen() -> bool:
    """Whether there is one to show anything on."""
    if sys.platform != "linux":
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
