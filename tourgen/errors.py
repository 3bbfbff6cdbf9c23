"""Everything that tourgen raises on purpose.

TourgenError
├── InputError      what the publisher gave cannot be used (exit code 2)
├── StageError      a stage could not do its work on one room (exit code 1)
└── MissingTool     this machine lacks something (exit code 1)

A message is one line, "subject: expected ..., found ...", without a full stop; the hint says
what to do about it. Arguments are positional only, so that errors cross process borders.
"""

from __future__ import annotations


class TourgenError(Exception):
    """The root of the tree.

    Args:
        message: One line: the subject, what was expected, what was found.
        hint: One line: what to do about it, or "" where nothing helps.
    """

    exit_code = 1

    def __init__(self, message: str, hint: str = "", /) -> None:
        super().__init__(message, hint)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return self.message


class InputError(TourgenError):
    """A tour file or a scan cannot be used as it is."""

    exit_code = 2


class StageError(TourgenError):
    """A stage could not do its work on one room."""


class MissingTool(TourgenError):
    """This machine lacks a library or program."""


class Faults(InputError):
    """Several input faults told at once.

    Args:
        faults: At least one.
    """

    def __init__(self, faults: tuple[InputError, ...], /) -> None:
        Exception.__init__(self, faults)
        self.faults = faults
        self.message = "\n".join(fault.message for fault in faults)
        self.hint = ""
