"""Run: serve a tour on loopback, and keep a browser on it."""

from __future__ import annotations

import hashlib
import signal
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from threading import Event, Thread
from typing import Final

import platformdirs

from tourgen.alone import alone
from tourgen.doctor import BROWSERS, browser
from tourgen.errors import InputError, MissingTool
from tourgen.kiosk.lines import KioskHandler
from tourgen.kiosk.screen import end_leftovers, has_screen, start_browser, stop_browser
from tourgen.kiosk.vigil import Vigil
from tourgen.serve import open_server
from tourgen.site import restore_site

_TICK_S: Final = 0.2
_MOST_PAUSE_S: Final = 30.0
_SWAP_S: Final = 2.0
"""A build that takes longer from one rename to the next was killed between them."""


def run_kiosk(site: Path, port: int = 8710, say: Callable[[str], None] = print) -> None:
    """Show a published tour until it is closed from its service corner, or interrupted.

    Args:
        site: Its folder. A new version that is put there is taken over while nobody is about.
        port: On loopback; the next free one above where it is taken. What the screen keeps, visits
            and the tour itself, is kept under the port: it should stay the same.
        say: Told what happens.

    Raises:
        InputError: There is no tour, another kiosk shows it, or there is no screen.
        MissingTool: There is no Chromium.
        StageError: No port was free.
    """
    program = browser()
    if program is None:
        raise MissingTool(
            f"chromium: expected one of {', '.join(BROWSERS)} on the path, found none",
            "install it, as `apt-get install chromium`",
        )
    if not has_screen():
        raise InputError(
            "screen: expected one to show the tour on, found none",
            "start it from the desktop's own session, or set DISPLAY",
        )
    restore_site(site)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # with the browser, as by Ctrl+C
    kept = _kept(site)
    busy = InputError(
        f"`{site}`: expected no other kiosk, found one that shows it",
        "close that one first, by its service corner or Ctrl+C",
    )
    with alone(kept / "lock", busy):
        vigil, ended = Vigil(), Event()
        answer = partial(KioskHandler, vigil=vigil, ended=ended, kept=kept)
        with open_server(site, port=port, handler=answer) as server:
            Thread(target=server.serve_forever, daemon=True).start()
            Thread(target=_keep_whole, args=(site, ended), daemon=True).start()
            taken = f" (port {port} is taken)" if server.server_address[1] != port else ""
            say(f"Showing {site} from {server.address}{taken}, stop with Ctrl+C")
            address = f"{server.address}kiosk.html?watched"
            profile = kept / "browser"
            end_leftovers(profile)
            try:
                with suppress(KeyboardInterrupt):
                    _keep_showing(
                        partial(start_browser, program, profile, address), vigil, ended, say
                    )
            finally:
                ended.set()
                server.shutdown()


def _keep_whole(site: Path, ended: Event) -> None:
    """Put the site back that a build killed while swapping has left aside."""
    while not ended.wait(_SWAP_S):
        if not site.exists() and not ended.wait(_SWAP_S) and not site.exists():
            with suppress(OSError):  # another build is faster
                restore_site(site)


def _keep_showing(
    start: Callable[[], subprocess.Popen[bytes]],
    vigil: Vigil,
    ended: Event,
    say: Callable[[str], None],
) -> None:
    """Start the browser as often as it ends."""
    pause_s = 0.0
    while not ended.is_set():
        vigil.begin()
        shown = start()
        try:
            fault = _watched(shown.poll, vigil, ended)
        finally:
            stop_browser(shown)
        if fault is None:
            return
        say(f"{time.strftime('%Y-%m-%d %H:%M:%S')} {fault}; the browser is started anew")
        # One that shows nothing may never do: it is waited for ever longer.
        pause_s = 0.0 if vigil.came else min(max(1.0, 2 * pause_s), _MOST_PAUSE_S)
        ended.wait(pause_s)


def _watched(ends: Callable[[], int | None], vigil: Vigil, ended: Event) -> str | None:
    """Why the browser is to be started anew; None once the kiosk is closed."""
    while not ended.wait(_TICK_S):
        if ends() is not None:
            return "the browser has ended"
        if vigil.fault:
            return vigil.fault
    return None


def _kept(site: Path) -> Path:
    """Where what is kept of this kiosk lies on this machine."""
    name = hashlib.sha256(str(site.resolve()).encode()).hexdigest()[:12]
    return Path(platformdirs.user_state_dir("tourgen")) / f"kiosk-{name}"
