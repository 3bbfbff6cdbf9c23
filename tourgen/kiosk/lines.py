"""Lines: what the kiosk's server answers beside the tour."""

from __future__ import annotations

import time
from http import HTTPStatus
from pathlib import Path
from threading import Event
from typing import Any, Final

from tourgen.kiosk.vigil import Vigil
from tourgen.serve import TourHandler

FOLDER: Final = "/.kiosk/"
_EVERY_S: Final = 0.5
_MOST_BYTES: Final = 4 << 20


class KioskHandler(TourHandler):
    """Answers the tour, and the page's line to who watches it.

    Args:
        vigil: Told of the page's life.
        ended: Set when the person in charge closes the kiosk.
        kept: Folder where the table of visits is written to.
    """

    def __init__(self, *args: Any, vigil: Vigil, ended: Event, kept: Path, **settings: Any) -> None:
        self._vigil, self._ended, self._kept = vigil, ended, kept
        super().__init__(*args, **settings)

    def do_GET(self) -> None:  # noqa: N802 - so it is called
        """The line, or a file of the tour."""
        if self.path == f"{FOLDER}line":
            self._hold_line()
        else:
            super().do_GET()

    def do_POST(self) -> None:  # noqa: N802 - so it is called
        """What the page tells; a page of another origin is not heard."""
        size = int(self.headers.get("Content-Length") or 0)
        own = f"http://{self.headers.get('Host')}"
        if self.headers.get("Origin") != own or size > _MOST_BYTES:
            self.close_connection = True
            self._answer(HTTPStatus.FORBIDDEN)
            return
        body = self.rfile.read(size)
        if self.path == f"{FOLDER}alive":
            self._vigil.alive()
            self._answer(HTTPStatus.OK)
        elif self.path == f"{FOLDER}leaves":
            self._vigil.begin()
            self._answer(HTTPStatus.OK)
        elif self.path == f"{FOLDER}visits":
            self._keep(body)
        elif self.path == f"{FOLDER}end":
            self._answer(HTTPStatus.OK)
            self._ended.set()
        else:
            self._answer(HTTPStatus.NOT_FOUND)

    def _hold_line(self) -> None:
        """An event stream without events (WHATWG HTML, 9.2): it breaks when the page dies."""
        self.close_connection = True
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", "text/event-stream")
        self.end_headers()
        start = self._vigil.opened()
        try:
            self.wfile.write(b"retry: 500\n\n")
            while not self._ended.is_set():
                self.wfile.write(b":\n\n")
                time.sleep(_EVERY_S)
        except OSError:
            return
        finally:
            self._vigil.closed(start)

    def _keep(self, table: bytes) -> None:
        path = self._kept / f"visits-{time.strftime('%Y-%m-%d')}.csv"
        aside = path.with_suffix(".new")
        try:
            aside.write_bytes(table)
            aside.replace(path)
        except OSError as error:
            aside.unlink(missing_ok=True)
            self._answer(HTTPStatus.INSUFFICIENT_STORAGE, error.strerror or "")
        else:
            self._answer(HTTPStatus.OK, str(path))

    def _answer(self, status: HTTPStatus, text: str = "") -> None:
        content = text.encode()
        self.send_response(status)
        self.send_header("Content-Type", "text/plain; charset=utf-8")
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)
