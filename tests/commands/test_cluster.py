"""The same site comes out of one process, of two, and of a dask cluster that loses a worker."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from dask_cluster import cluster
from published import published_files

from tourgen.cli import main


def built(folder: Path, *arguments: str) -> dict[str, bytes]:
    """The site that a command of its own makes of a tour, without a cache."""
    shutil.rmtree(folder / ".tourgen", ignore_errors=True)
    shutil.rmtree(folder / "site", ignore_errors=True)
    command = [sys.executable, "-m", "tourgen.cli", "build", str(folder), *arguments]
    subprocess.run(command, check=True, capture_output=True, timeout=600)
    return published_files(folder / "site")


def test_the_same_bytes_from_one_process_from_two_and_from_a_cluster(
    box_copy: Path, tmp_path: Path
) -> None:
    one = built(box_copy, "--jobs", "1")
    assert built(box_copy, "--jobs", "2") == one
    with cluster(tmp_path) as (address, _):
        assert built(box_copy, "--cluster", address) == one


def test_a_worker_that_is_killed_costs_a_retry(box_copy: Path, tmp_path: Path) -> None:
    before = published_files(box_copy / "site")
    shutil.rmtree(box_copy / ".tourgen")
    with cluster(tmp_path) as (address, workers):
        command = [sys.executable, "-m", "tourgen.cli", "build", str(box_copy)]
        command += ["--cluster", address]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as build:
            assert build.stderr
            told = []
            for line in build.stderr:
                told.append(line)
                if "surface" in line and workers[0].poll() is None:
                    workers[0].send_signal(signal.SIGKILL)
            assert build.wait() == 0, "".join(told)
    assert workers[0].returncode == -signal.SIGKILL
    assert published_files(box_copy / "site") == before


def test_no_scheduler_is_one_clear_line(
    box_copy: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tourgen.workers._ANSWER_S", 1)
    before = published_files(box_copy / "site")
    shutil.rmtree(box_copy / ".tourgen")
    capsys.readouterr()
    assert main(["build", str(box_copy), "--cluster", "tcp://127.0.0.1:9"]) == 2
    told = capsys.readouterr().err.strip().splitlines()
    assert told[0] == (
        "error: --cluster: expected a scheduler that answers at `tcp://127.0.0.1:9`, found none"
    )
    assert told[-1].startswith("hint: start `dask scheduler`")
    assert published_files(box_copy / "site") == before


def test_workers_of_several_threads_are_refused_in_a_line(
    box_copy: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As `dask worker` starts them: they share what some libraries keep of a mesh at work."""
    (box_copy / "tour.toml").touch()
    shutil.rmtree(box_copy / ".tourgen")
    with cluster(tmp_path, (None,), threads=2) as (address, _):
        assert main(["build", str(box_copy), "--cluster", address]) == 2
    told = capsys.readouterr().err
    assert f"expected workers of one thread at `{address}`, found one of 2" in told
    assert "dask worker --nthreads 1" in told
