"""Scans and sites that lie in S3, as a server on this machine speaks it."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from published import published_files

from tourgen.cli import main

BUCKET = "lighthouse"


@pytest.fixture(scope="module")
def s3(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A file system on a server with one bucket, which new processes and clients find as well."""
    import s3fs

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    told = {
        "AWS_ACCESS_KEY_ID": "keeper",
        "AWS_SECRET_ACCESS_KEY": "lamp",
        "AWS_DEFAULT_REGION": "us-east-1",
        "AWS_ENDPOINT_URL": f"http://127.0.0.1:{port}",
    }
    log = tmp_path_factory.mktemp("s3") / "server.log"
    with pytest.MonkeyPatch.context() as environment, log.open("wb") as stream:
        for name, value in told.items():
            environment.setenv(name, value)
        command = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)]
        server = subprocess.Popen(command, stdout=stream, stderr=stream)
        try:
            while not _listens(port):
                assert server.poll() is None, log.read_text("utf-8")
                time.sleep(0.1)
            storage = s3fs.S3FileSystem(skip_instance_cache=True, use_listings_cache=False)
            storage.mkdir(BUCKET)
            yield storage
        finally:
            server.kill()
            server.wait()


def _listens(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def test_scans_and_site_in_s3(s3: Any, box_copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = published_files(box_copy / "site")
    for room in ("left", "right"):
        s3.put_file(str(box_copy / f"scans/{room}.ply"), f"{BUCKET}/scans/{room}.ply")
        (box_copy / f"scans/{room}.ply").unlink()
    tour = (box_copy / "tour.toml").read_text("utf-8")
    tour = tour.replace('"scans/', f'"s3://{BUCKET}/scans/')
    (box_copy / "tour.toml").write_text(tour, "utf-8")
    s3.pipe_file(f"{BUCKET}/site/rooms/attic/index.html", b"of a room that is no more")
    s3.pipe_file(f"{BUCKET}/site/tour.json", b"{}")
    out = f"s3://{BUCKET}/site"
    capsys.readouterr()
    assert main(["build", str(box_copy), "-o", out, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["ran_stages"] == 0, "the same bytes are the same scans, wherever they lie"
    sent = {
        name.removeprefix(f"{BUCKET}/site/"): s3.cat_file(name)
        for name in s3.find(f"{BUCKET}/site")
        if "/report." not in name
    }
    assert sent == before
    assert main(["build", str(box_copy), "-o", out]) == 0
    assert "fetching" not in capsys.readouterr().err, "what has not changed is here already"
    scan = bytearray(s3.cat_file(f"{BUCKET}/scans/left.ply"))
    scan[-1] ^= 1  # of a colour
    s3.pipe_file(f"{BUCKET}/scans/left.ply", bytes(scan))
    assert main(["build", str(box_copy), "-o", out, "--json"]) == 0
    told = capsys.readouterr()
    assert f"fetching s3://{BUCKET}/scans/left.ply" in told.err
    assert json.loads(told.out)["rooms"]["left"]["ran"]


@pytest.mark.usefixtures("s3")
@pytest.mark.parametrize(
    ("address", "told"),
    [
        (f"s3://{BUCKET}/scans/attic.ply", "expected a file, found none at"),
        ("s3://nowhere/left.ply", "expected a file, found none at"),
        ("nosuch://store/left.ply", "expected storage that answers, found: Protocol not known"),
    ],
)
def test_an_address_with_nothing_behind_it_is_one_clear_line(
    box_copy: Path, capsys: pytest.CaptureFixture[str], address: str, told: str
) -> None:
    before = published_files(box_copy / "site")
    tour = (box_copy / "tour.toml").read_text("utf-8").replace("scans/left.ply", address)
    (box_copy / "tour.toml").write_text(tour, "utf-8")
    capsys.readouterr()
    assert main(["build", str(box_copy)]) == 2
    output = capsys.readouterr().err
    (line,) = (line for line in output.splitlines() if line.startswith("error: "))
    assert told in line
    assert address in line
    assert published_files(box_copy / "site") == before


def test_other_files_are_not_written_over(
    s3: Any, box_copy: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    s3.pipe_file(f"{BUCKET}/letters/one.txt", b"dear keeper")
    assert main(["build", str(box_copy), "-o", f"s3://{BUCKET}/letters"]) == 2
    assert "expected a tour or nothing" in capsys.readouterr().err
    assert s3.find(f"{BUCKET}/letters") == [f"{BUCKET}/letters/one.txt"]
