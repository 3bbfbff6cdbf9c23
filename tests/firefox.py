"""Firefox, driven by its own Marionette protocol: a length, a colon and JSON over TCP.

What Debian installs needs no driver beside it, but a screen: without one (``--headless``) it draws
no WebGL (https://bugzilla.mozilla.org/show_bug.cgi?id=1375585), so it gets a virtual one.
https://firefox-source-docs.mozilla.org/testing/marionette/Protocol.html
"""

from __future__ import annotations

import base64
import io
import json
import os
import socket
import subprocess
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from PIL import Image
from visitor import Picture

PATIENCE_S: Final = 90
_PREFERENCES: Final[Mapping[str, object]] = {
    "marionette.port": 0,  # a free one, which it writes into its profile
    "webgl.force-enabled": True,  # drawn in software where there is no graphics card
    "app.update.enabled": False,
    "browser.shell.checkDefaultBrowser": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
    "toolkit.telemetry.server": "",
}


@dataclass
class Firefox:
    """One window."""

    wire: socket.socket
    asked: int = 0

    def greet(self) -> None:
        """Begin a session."""
        self._hear()  # who it is
        self.call("WebDriver:NewSession", capabilities={})

    def call(self, command: str, **parameters: Any) -> Any:
        """Have a command done.

        Raises:
            RuntimeError: Firefox says why not.
        """
        self.asked += 1
        message = json.dumps([0, self.asked, command, parameters]).encode()
        self.wire.sendall(b"%d:%s" % (len(message), message))
        _, _, error, result = self._hear()
        if error:
            raise RuntimeError(f"{command}: {error['error']}: {error['message']}")
        return result

    def evaluate(self, expression: str) -> Any:
        """The value of an expression in the page."""
        told = self.call("WebDriver:ExecuteScript", script=f"return {expression};", args=[])
        return told["value"]

    def wait(self, condition: str) -> None:
        """Wait until an expression is true."""
        end = time.monotonic() + PATIENCE_S
        while not self.evaluate(f"Boolean({condition})"):
            assert time.monotonic() < end, f"{condition}: still not so after {PATIENCE_S} s"
            time.sleep(0.1)

    def hold(self, key: str, ms: int) -> None:
        """Press a key for a while."""
        steps = [{"type": "keyDown", "value": key}, {"type": "pause", "duration": ms}]
        steps.append({"type": "keyUp", "value": key})
        hands = [{"type": "key", "id": "keyboard", "actions": steps}]
        self.call("WebDriver:PerformActions", actions=hands)

    def picture(self) -> Picture:
        """(h, w, 3) what the window shows."""
        told = self.call("WebDriver:TakeScreenshot", full=False)
        data = base64.b64decode(told["value"])
        return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))

    def _hear(self) -> Any:
        size = b""
        while not size.endswith(b":"):
            size += self._read(1)
        return json.loads(self._read(int(size[:-1])))

    def _read(self, size: int) -> bytes:
        data = b""
        while len(data) < size:
            piece = self.wire.recv(size - len(data))
            if not piece:
                raise ConnectionError("firefox: hung up")
            data += piece
        return data


@contextmanager
def opened(program: Path, profile: Path, size: tuple[int, int]) -> Iterator[Firefox]:
    """Start Firefox on a screen that nobody sees, with a profile of its own."""
    told = [f"user_pref({json.dumps(k)}, {json.dumps(v)});\n" for k, v in _PREFERENCES.items()]
    (profile / "user.js").write_text("".join(told), "utf-8")
    command = [str(program), "--marionette", "--no-remote", "--profile", str(profile)]
    command += [f"--width={size[0]}", f"--height={size[1]}"]
    with ExitStack() as stack:
        place = {**os.environ, "DISPLAY": stack.enter_context(_screen(size))}
        log = stack.enter_context((profile / "log").open("wb"))
        process = subprocess.Popen(command, stdout=log, stderr=log, env=place)
        stack.enter_context(_ended(process))
        wire = socket.create_connection(("127.0.0.1", _port(process, profile)), PATIENCE_S)
        firefox = Firefox(stack.enter_context(wire))
        firefox.greet()
        yield firefox


@contextmanager
def _screen(size: tuple[int, int]) -> Iterator[str]:
    """A virtual screen, by the name that X11 knows it by."""
    width, height = size
    command = ["Xvfb", "-displayfd", "1", "-screen", "0", f"{width}x{height}x24"]
    command += ["-nolisten", "tcp"]
    with _ended(
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    ) as process:
        assert process.stdout
        number = process.stdout.readline().decode("ascii").strip()
        assert number, "Xvfb: expected a screen, found none"
        yield f":{number}"


@contextmanager
def _ended(process: subprocess.Popen[bytes]) -> Iterator[subprocess.Popen[bytes]]:
    """A process that does not outlive what it is for."""
    try:
        yield process
    finally:
        process.terminate()
        process.wait(PATIENCE_S)
        if process.stdout:
            process.stdout.close()


def _port(process: subprocess.Popen[bytes], profile: Path) -> int:
    """Where Firefox listens, once it does."""
    file = profile / "MarionetteActivePort"
    end = time.monotonic() + PATIENCE_S
    while process.poll() is None and time.monotonic() < end:
        if file.exists() and (told := file.read_text("ascii").strip()):
            return int(told)
        time.sleep(0.1)
    raise RuntimeError(f"firefox: {(profile / 'log').read_text('utf-8', 'replace')[-2000:]}")
