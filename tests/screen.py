"""A screen, and `tourgen kiosk` on it: a headed Chromium under Xvfb, hands by xdotool."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from playwright.sync_api import Error as BrowserError
from playwright.sync_api import Page, Playwright
from playwright.sync_api import TimeoutError as TimedOut

PATIENCE_S = 90.0
SCREEN = (1280, 800)
"""Pixels of the screen that most kiosks of the tests are shown on."""
ATTRACTS = (
    "Boolean(window.tourgen?.ready) && document.getElementById('tour').dataset.state === 'attract'"
)
_ENDS_WITHIN_S = 15.0
_CONNECT_MS = 2_000.0
"""A browser that is just ending may take a call, and never answer."""
_LOOKS_EVERY_S = 0.25
_WATCHED = Path(__file__).parent / "commands/kiosk_watched.py"


@contextmanager
def screen_of(width: int, height: int) -> Iterator[str]:
    """A screen without a window manager, as kiosks often have: its name."""
    reading, writing = os.pipe()
    command = ["Xvfb", "-displayfd", str(writing), "-screen", "0", f"{width}x{height}x24"]
    with subprocess.Popen(
        [*command, "-nolisten", "tcp"], pass_fds=[writing], stderr=subprocess.DEVNULL
    ) as server:
        os.close(writing)
        try:
            with os.fdopen(reading) as told:
                yield f":{told.readline().strip()}"
        finally:
            server.terminate()


@dataclass
class Kiosk:
    """A kiosk that runs.

    Attributes:
        process: `tourgen kiosk`.
        log: What it says.
        door: Where its browser can be looked into.
        settings: Its environment.
    """

    process: subprocess.Popen[bytes]
    log: Path
    door: int
    settings: Mapping[str, str]
    driver: Playwright

    @property
    def said(self) -> str:
        return self.log.read_text("utf-8")

    def page(self, condition: str = ATTRACTS, within_s: float = PATIENCE_S) -> Page:
        """Its page, once a condition holds in it."""
        end, patience_ms = time.monotonic() + within_s, _CONNECT_MS
        while time.monotonic() < end:
            assert self.process.poll() is None, self.said
            browser = None
            try:
                door = f"http://127.0.0.1:{self.door}"
                browser = self.driver.chromium.connect_over_cdp(door, timeout=patience_ms)
                for page in browser.contexts[0].pages:
                    # Unlike `evaluate` it gives up a page that hangs. It does not ask twice: the
                    # published headers refuse that, and it ends by an error.
                    page.wait_for_function(condition, timeout=patience_ms, polling=100)
                    return page
            except TimedOut:
                patience_ms *= 2  # on a busy machine it takes its time
            except BrowserError:
                pass
            if browser:
                browser.close()  # it goes on: what is given up is the look into it
            time.sleep(_LOOKS_EVERY_S)
        raise AssertionError(f"{condition}: not so within {within_s} s; {self.said}")

    def family(self, kind: str = "") -> list[int]:
        """Its browser's processes, of a kind or the first of all."""
        profile = self.settings["XDG_STATE_HOME"]
        found = []
        for folder in Path("/proc").glob("[0-9]*"):
            try:
                words = (folder / "cmdline").read_bytes().decode(errors="replace")
            except OSError:
                continue
            is_kind = f"--type={kind}" in words if kind else "--type=" not in words
            if f"--user-data-dir={profile}" in words and is_kind:
                found.append(int(folder.name))
        return found

    def hand(self, *words: str) -> None:
        """One act of xdotool."""
        subprocess.run(["xdotool", *words], env=self.settings, check=False, capture_output=True)

    def windows(self) -> list[str]:
        """Names of what can be seen on the screen."""
        listed = ["xdotool", "search", "--onlyvisible", "--name", ".+"]
        found = subprocess.run(listed, env=self.settings, capture_output=True, text=True)
        return [
            subprocess.run(
                ["xdotool", "getwindowname", each],
                env=self.settings,
                capture_output=True,
                text=True,
            ).stdout.strip()
            for each in found.stdout.split()
        ]

    def close(self) -> None:
        """As Ctrl+C does."""
        self.process.send_signal(signal.SIGINT)
        try:
            assert self.process.wait(_ENDS_WITHIN_S) == 0 or self.said.startswith("error:"), (
                self.said
            )
        except BaseException:
            self.process.kill()
            for browser in self.family():
                os.kill(browser, signal.SIGKILL)
            raise


def start_kiosk(
    site: Path,
    log: Path,
    settings: Mapping[str, str],
    driver: Playwright,
    *,
    port: int = 0,
    within: Sequence[str] = (),
) -> Kiosk:
    """Start one.

    Args:
        site: What it shows.
        log: Where it says what happens.
        settings: Its environment: DISPLAY and XDG_STATE_HOME.
        driver: What looks into its browser.
        port: Where it serves; any if left out.
        within: Words before its own, of a program that starts it.
    """
    door, port = free_port(), port or free_port()
    command = [*within, sys.executable, _WATCHED, site, str(port), str(door)]
    with log.open("ab") as stream:
        process = subprocess.Popen(command, env=settings, stdout=stream, stderr=stream)
    return Kiosk(process, log, door, settings, driver)


def free_port() -> int:
    with socket.socket() as asked:
        asked.bind(("127.0.0.1", 0))
        return int(asked.getsockname()[1])
