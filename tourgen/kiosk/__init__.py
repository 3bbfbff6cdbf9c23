"""The kiosk: a published tour on a screen that nobody attends, for days."""

from tourgen.kiosk.run import run_kiosk

__all__ = ["run_kiosk"]
