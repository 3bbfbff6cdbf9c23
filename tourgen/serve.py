"""A local server for a published tour: right types, byte ranges, the published headers."""

from __future__ import annotations

import http.server
import re
import shutil
import sys
from collections.abc import Callable
from functools import partial
from http import HTTPStatus
from io import BytesIO
from pathlib import Path
from socketserver import ThreadingMixIn
from typing import TYPE_CHECKING, Any, BinaryIO, Final

from tourgen.errors import InputError, StageError
from tourgen.headers import IMMUTABLE, REVALIDATED, SECURITY_HEADERS, content_type
from tourgen.site import is_site, restore_site

if TYPE_CHECKING:
    from _typeshed import SupportsRead, SupportsWrite

PORTS_TRIED: Final = 20

_RANGE: Final = re.compile(r"bytes=(\d*)-(\d*)")


class TourServer(ThreadingMixIn, http.server.HTTPServer):
    """Serves one folder to several visitors at once."""

    daemon_threads = True
    # Elsewhere a port whose last visitors left a moment ago is free; Windows would share it with a
    # second server, which must find out instead.
    allow_reuse_address = sys.platform != "win32"

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Tell what went wrong, but not that a browser was closed."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)

    @property
    def address(self) -> str:
        """What to type into a browser."""
        host, port = self.server_address[:2]
        name = host.decode() if isinstance(host, bytes | bytearray) else host
        return f"http://{f'[{name}]' if ':' in name else name}:{port}/"


def open_server(
    folder: Path,
    host: str = "127.0.0.1",
    port: int = 8000,
    handler: Callable[..., TourHandler] | None = None,
) -> TourServer:
    """Bind a server for a published tour; the caller lets it run and closes it.

    Args:
        folder: The site's folder.
        host: Address to listen on.
        port: Where to listen; the next free one above it where it is taken, 0 for any.
        handler: What answers, given ``directory``; ``TourHandler`` if left out.

    Raises:
        InputError: ``folder`` holds no tour.
        StageError: No port was free.
    """
    restore_site(folder)
    if not is_site(folder):
        raise InputError(
            f"`{folder}`: expected a tour, found no tour.json",
            "build it first with `tourgen build`",
        )
    answer = partial(handler or TourHandler, directory=str(folder))
    for candidate in range(port, min(port + PORTS_TRIED, 65536)) if port else (0,):
        try:
            return TourServer((host, candidate), answer)
        except OSError as error:
            refused = error
    raise StageError(
        f"server: expected a free port from {port} on, found: {refused.strerror or refused}",
        "choose another with `--port`",
    )


def serve(
    folder: Path, host: str = "127.0.0.1", port: int = 8000, say: Callable[[str], None] = print
) -> None:
    """Serve a published tour until interrupted.

    Args:
        folder: The site's folder.
        host: Address to listen on.
        port: Where to listen; the next free one above it where it is taken.
        say: Gets the one line that tells the address.

    Raises:
        InputError: ``folder`` holds no tour.
        StageError: No port was free.
    """
    with open_server(folder, host, port) as server:
        taken = f" (port {port} is taken)" if port and server.server_address[1] != port else ""
        say(f"Serving {folder} at {server.address}{taken}, stop with Ctrl+C")
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            return


class TourHandler(http.server.SimpleHTTPRequestHandler):
    """Answers for one folder."""

    protocol_version = "HTTP/1.1"
    server_version = "tourgen"
    sys_version = ""

    def guess_type(self, path: object) -> str:
        """Types by our own table first: that of the machine may lack the newer ones."""
        return content_type(str(path))

    def end_headers(self) -> None:
        """With the headers that every file of a tour is sent with."""
        for key, value in SECURITY_HEADERS.items():
            self.send_header(key, value)
        forever = self.path.startswith("/viewer/")
        self.send_header("Cache-Control", IMMUTABLE if forever else REVALIDATED)
        super().end_headers()

    def send_head(self) -> BytesIO | BinaryIO | None:
        """Answer a range with its bytes; everything else as usual."""
        asked = _RANGE.fullmatch(self.headers.get("Range", ""))
        path = Path(self.translate_path(self.path))
        self._forget_other_date(path)
        if asked is None or not any(asked.groups()) or not path.is_file():
            return super().send_head()
        size = path.stat().st_size
        first, last = _bounds(asked[1], asked[2], size)
        if first > last:
            self.send_response(HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE)
            self.send_header("Content-Range", f"bytes */{size}")
            self.send_header("Content-Length", "0")
            self.end_headers()
            return None
        with path.open("rb") as file:
            file.seek(first)
            part = file.read(last - first + 1)
        self.send_response(HTTPStatus.PARTIAL_CONTENT)
        self.send_header("Content-Type", self.guess_type(path))
        self.send_header("Content-Length", str(len(part)))
        self.send_header("Content-Range", f"bytes {first}-{last}/{size}")
        self.end_headers()
        return BytesIO(part)

    def _forget_other_date(self, path: Path) -> None:
        """Only what is of the very date asked about is the same: an older file is another one."""
        asked = self.headers.get("If-Modified-Since")
        if asked and path.is_file() and asked != self.date_time_string(path.stat().st_mtime):
            del self.headers["If-Modified-Since"]

    def send_response(self, code: int, message: str | None = None) -> None:
        """Say that parts may be asked for."""
        super().send_response(code, message)
        if code in (HTTPStatus.OK, HTTPStatus.PARTIAL_CONTENT):
            self.send_header("Accept-Ranges", "bytes")

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """For a page that is not there, the tour's own page about it, as other hosts do."""
        page = Path(self.directory) / "404.html"
        asks_page = Path(self.path.partition("?")[0]).suffix in ("", ".html")
        if code != HTTPStatus.NOT_FOUND or not asks_page or not page.is_file():
            super().send_error(code, message, explain)
            return
        content = page.read_bytes()
        self.send_response(code)
        self.send_header("Content-Type", self.guess_type(page))
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(content)

    def copyfile(self, source: SupportsRead[bytes], outputfile: SupportsWrite[bytes]) -> None:  # type: ignore[override]
        """A visitor who leaves while a tile is on its way is no fault."""
        try:
            shutil.copyfileobj(source, outputfile)
        except (BrokenPipeError, ConnectionResetError):
            self.close_connection = True

    def log_message(self, *_: object) -> None:
        """Keep the terminal for what matters."""


def _bounds(first: str, last: str, size: int) -> tuple[int, int]:
    """First and last byte of ``bytes=first-last``, either of which may be empty."""
    if not first:
        return max(0, size - int(last)), size - 1
    return int(first), min(int(last), size - 1) if last else size - 1
