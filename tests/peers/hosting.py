"""A host as visitors meet it: text is sent compressed, and what was sent is told by the byte.

The tour's own preview server compresses nothing; hosts do, and so must whoever counts bytes.
"""

from __future__ import annotations

import gzip
import hashlib
import mimetypes
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import cache, partial
from http import HTTPStatus
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from threading import Thread
from typing import Any

from tourgen.headers import IMMUTABLE, REVALIDATED

_TEXT = (".css", ".cjs", ".html", ".js", ".json", ".mjs", ".svg", ".wasm")
_TYPES = {".cjs": "text/javascript", ".glb": "model/gltf-binary", ".mjs": "text/javascript"}


@dataclass(frozen=True)
class Answer:
    """What was sent once.

    Attributes:
        path: Asked for, without its query.
        size: Bytes, headers included.
        at: ``time.time()`` when it began.
    """

    path: str
    size: int
    at: float


@dataclass
class Host:
    """A running host.

    Attributes:
        origin: Its address, without a slash at the end.
        answers: All that it sent, in order.
    """

    origin: str = ""
    answers: list[Answer] = field(default_factory=list)

    def sent(self, *, until: float = float("inf"), kind: str = "") -> int:
        """Bytes of the answers that began before a time, of files whose names end alike."""
        return sum(a.size for a in self.answers if a.at <= until and a.path.endswith(kind))


@contextmanager
def hosted(folder: Path, headers: Mapping[str, str]) -> Iterator[Host]:
    """Serve a folder on loopback, each file with some headers."""
    host = Host()
    handler = partial(_Handler, directory=str(folder), host=host, headers=headers)
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        host.origin = f"http://127.0.0.1:{server.server_port}"
        Thread(target=server.serve_forever, daemon=True).start()
        yield host
        server.shutdown()


@contextmanager
def hosted_apart(folder: Path, headers: Mapping[str, str]) -> Iterator[str]:
    """The same from a process of its own, as hosts are: the address.

    One in this process waits for whatever drives the browser, the longer the more is asked for.
    """
    context = get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=_host, args=(folder, dict(headers), there), daemon=True)
    process.start()
    try:
        yield str(here.recv())
    finally:
        process.terminate()
        process.join()


def _host(folder: Path, headers: Mapping[str, str], told: Connection) -> None:
    with hosted(folder, headers) as host:
        told.send(host.origin)
        told.recv()  # until it is ended


class _Handler(SimpleHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def __init__(self, *args: Any, host: Host, headers: Mapping[str, str], directory: str):
        self._host, self._headers = host, headers
        super().__init__(*args, directory=directory)

    def handle(self) -> None:
        with suppress(ConnectionError):  # a browser that is closed hangs up
            super().handle()

    def do_GET(self) -> None:
        path = self.path.partition("?")[0]
        file = Path(self.translate_path(path))
        file = file / "index.html" if file.is_dir() else file
        if not file.is_file():
            self._send(path, HTTPStatus.NOT_FOUND, {}, b"")
            return
        body, mark, packed = _content(file, file.stat().st_mtime_ns)
        headers = {**self._headers, "ETag": mark, "Content-Type": _type(file)}
        headers["Cache-Control"] = IMMUTABLE if path.startswith("/viewer/") else REVALIDATED
        if packed:
            headers["Content-Encoding"] = "gzip"
        if self.headers.get("If-None-Match") == mark:
            self._send(path, HTTPStatus.NOT_MODIFIED, headers, b"")
        else:
            self._send(path, HTTPStatus.OK, headers, body)

    def _send(self, path: str, status: HTTPStatus, headers: dict[str, str], body: bytes) -> None:
        lines = [f"HTTP/1.1 {status.value} {status.phrase}"]
        if status != HTTPStatus.NOT_MODIFIED:
            headers["Content-Length"] = str(len(body))
        lines += [f"{name}: {value}" for name, value in headers.items()]
        whole = "\r\n".join([*lines, "", ""]).encode() + body
        self._host.answers.append(Answer(path, len(whole), time.time()))
        self.wfile.write(whole)

    def log_message(self, *_: object) -> None:
        """Say nothing."""


@cache
def _content(file: Path, _changed: int) -> tuple[bytes, str, bool]:
    """What is sent of a file, its mark, and whether it is compressed."""
    data = file.read_bytes()
    mark = f'"{hashlib.sha256(data).hexdigest()[:16]}"'
    packed = file.suffix in _TEXT
    return (gzip.compress(data, 9) if packed else data), mark, packed


def _type(file: Path) -> str:
    kind = _TYPES.get(file.suffix) or mimetypes.types_map.get(file.suffix)
    return kind or "application/octet-stream"
