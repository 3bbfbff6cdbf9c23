"""TOML: read a file that a person wrote; what is wrong with it is told with its place."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any, Final

from tourgen.errors import Faults, InputError

_PLACE: Final = re.compile(r"^(.*) \(at (?:line (\d+), column (\d+)|end of document)\)$")


def read_toml(path: Path) -> dict[str, Any]:
    """Read a file (TOML 1.0; a byte order mark before it is no fault).

    Raises:
        FileNotFoundError: There is none.
        Faults: It cannot be read, or is no TOML.
    """
    try:
        return tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except FileNotFoundError:
        raise
    except OSError as error:
        told = InputError(
            f"{path.name}: expected a file that can be read, found: {error.strerror}",
            "look at its permissions",
        )
    except UnicodeDecodeError as error:
        told = InputError(
            f"{path.name}: expected UTF-8, found byte {error.object[error.start]:#x} at "
            f"position {error.start}",
            "save the file as UTF-8",
        )
    except tomllib.TOMLDecodeError as error:
        place = _PLACE.search(str(error))
        reason = place[1] if place else str(error)
        where = f"line {place[2]}, column {place[3]}" if place and place[2] else "end of the file"
        told = InputError(
            f"{path.name}: {where}: expected TOML, found: {reason[:1].lower()}{reason[1:]}",
            "look at this line and the one above: texts stand in straight quotes, "
            "what is opened is closed",
        )
    raise Faults((told,)) from None
