"""A build that is killed at any moment goes on where it stopped, and ends in the same site."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from published import published_files

from tourgen.cli import main

COMMAND = [sys.executable, "-m", "tourgen.cli", "build"]


def killed(folder: Path, stages: int, after_s: float) -> bool:
    """Begin a build and kill it, with all its processes; whether it was still at it.

    Args:
        folder: The tour's.
        stages: It may begin so many first.
        after_s: And then work so long.
    """
    build = subprocess.Popen(
        [*COMMAND, str(folder)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )
    assert build.stderr is not None
    with build.stderr:
        for _ in zip(range(stages), build.stderr, strict=False):
            pass
        try:
            build.wait(after_s)
        except subprocess.TimeoutExpired:
            os.killpg(build.pid, signal.SIGKILL)
            build.wait()
            return True
    return False


def told(capsys: pytest.CaptureFixture[str], *arguments: str) -> Any:
    capsys.readouterr()
    assert main([*arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_a_build_killed_at_any_moment_leads_to_the_same_site(
    box_copy: Path, capsys: pytest.CaptureFixture[str], pytestconfig: pytest.Config
) -> None:
    """``--kills`` times, each from an empty cache, at a moment drawn from the build's stages."""
    before = published_files(box_copy / "site")
    cache = box_copy / ".tourgen"
    shutil.rmtree(cache)
    begun = time.monotonic()
    whole = subprocess.run([*COMMAND, str(box_copy)], check=True, capture_output=True)
    begins = len(whole.stderr.splitlines())
    stage_s = (time.monotonic() - begun) / begins
    rng = random.Random(0)
    interrupted = 0
    for _ in range(pytestconfig.getoption("--kills")):
        shutil.rmtree(cache)
        interrupted += killed(box_copy, rng.randrange(begins), rng.uniform(0, 2 * stage_s))
        assert published_files(box_copy / "site") == before, "the site published before is whole"
        plan = told(capsys, "plan", str(box_copy))
        report = told(capsys, "build", str(box_copy))
        for room, stages in plan.items():
            ran = report["rooms"][room]["ran"]
            assert list(ran) == list(stages), "what was finished is not done again"
        assert published_files(box_copy / "site") == before
    assert interrupted
