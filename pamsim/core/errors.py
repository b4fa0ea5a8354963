"""Errors that reach a user: each says what is wrong, where, and how to mend it, in one line."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class PamsimError(Exception):
    """Root of every error pamsim raises on purpose; the command line turns it into exit code 2."""


class InputError(PamsimError):
    """What the user gave cannot be used: a bad value, unit, name, file or combination."""


class ParameterError(InputError):
    """A parameter lies outside its allowed range; the text names field, value and range."""


class EngineError(PamsimError):
    """MuJoCo and pamsim disagree: struct layout, plugin, unsupported integrator."""


class SimulationError(PamsimError):
    """A simulation ended before its time; the partial recording is kept in ``recording``."""

    def __init__(self, message: str, recording: object = None) -> None:
        super().__init__(message)
        self.recording = recording


def nearest(name: str, known: Iterable[str]) -> str:
    """Return the tail of an error sentence: the nearest known name and all that exist.

    Args:
        name: what the user wrote.
        known: the names that exist.

    Returns:
        For example ``did you mean 'kPa'? known: Pa, kPa, bar``.
    """
    names = sorted(known)
    close = difflib.get_close_matches(name, names, n=1)
    hint = f"did you mean {close[0]!r}? " if close else ""
    return f"{hint}known: {', '.join(names) or 'none'}"
