"""Read a TOML file that anyone may have written."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from pamsim.core.bounded_read import read_bounded
from pamsim.core.errors import InputError
from pamsim.core.limits import TOML_BYTES


def read_toml(path: Path) -> dict[str, Any]:
    """The table of a TOML file.

    Raises:
        FileNotFoundError: if there is no such file.
        InputError: if it cannot be read, is too large, or is not valid TOML.
    """
    try:
        return tomllib.loads(read_bounded(path, TOML_BYTES).decode("utf-8-sig"))
    except FileNotFoundError:
        raise
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from None
    except RecursionError:
        raise InputError(f"{path}: not valid TOML: nested too deep") from None
    except ValueError as error:  # of the syntax, of UTF-8, or of a number with too many digits
        raise InputError(f"{path}: not valid TOML: {error}") from None
