"""The commands: parse, call, print; no logic."""


def main() -> int:
    """Run tourgen."""
    return 0
