"""Errors that reach a user: each says what is wrong, where, and how to mend it, in one line."""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Iterable, Sequence

_LONGEST_WORD, _LONGEST = 200, 1000
_SUGGESTED, _LISTED = 5, 20  # names that are suggested; all that are listed beside them


class PamsimError(Exception):
    """Root of every error pamsim raises on purpose; the command line turns it into exit code 2.

    The message is one line that can be printed, whatever it quotes: a file may hold anything.
    """

    def __init__(self, message: str) -> None:
        text = " ".join(message.split())
        text = "".join(c if c.isprintable() else f"\\x{ord(c):02x}" for c in text)
        text = re.sub(rf"\S{{{_LONGEST_WORD},}}", lambda word: _cut(word[0], _LONGEST_WORD), text)
        super().__init__(_cut(text, _LONGEST))


def _cut(text: str, most: int) -> str:
    """A text without its middle, where it is longer than ``most`` characters."""
    return text if len(text) <= most else f"{text[: most * 2 // 3]} ... {text[-(most // 3 - 5) :]}"


class InputError(PamsimError):
    """What the user gave cannot be used: a bad value, unit, name, file or combination."""


class ParameterError(InputError):
    """A parameter lies outside its allowed range; the text names field, value and range."""


class EngineError(PamsimError):
    """MuJoCo and pamsim disagree: struct layout, plugin, unsupported integrator."""


class InvariantError(PamsimError):
    """A simulation has reached a state that cannot be; found by `pamsim.checks`."""


class SimulationError(PamsimError):
    """A simulation ended before its time; the partial recording is kept in ``recording``."""

    def __init__(self, message: str, recording: object = None) -> None:
        super().__init__(message)
        self.recording = recording


def first_few(names: Sequence[str], most: int) -> str:
    """The first names of some, and how many more there are."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def refuse_unknown(name: str, known: Collection[str], what: str) -> None:
    """Refuse a name that is none of the known ones: ``what`` is wrong, and the nearest."""
    if name not in known:
        raise InputError(f"{what}; {nearest(name, known)}")


def nearest(name: str, known: Iterable[str]) -> str:
    """Tail of an error: the known names nearest to what was written, and which exist.

    For example ``did you mean 'kPa'? known: Pa, kPa, bar``. Names of which the written one is a
    word are nearest, then the name, or those with the word, that it resembles most. Where there are
    many, and some are near, the others are left out.
    """
    names = sorted(known)
    with_word: dict[str, list[str]] = {one: [one] for one in names}
    for one in names:
        for part in re.split(r"[._: ]", one.lower()):
            with_word.setdefault(part, []).append(one)
    word = name.lower()
    if word not in with_word:
        word = next(iter(difflib.get_close_matches(name, with_word, n=1)), "")
    # Those that end in the word itself come first: damping is joint.shaft.damping.
    close = sorted(
        dict.fromkeys(with_word.get(word, ())),
        key=lambda one: one.lower().split(".")[-1] != word,
    )[:_SUGGESTED]
    hint = f"did you mean {' or '.join(map(repr, close))}?" if close else ""
    if hint and len(names) > _LISTED:
        return hint
    return f"{hint} known: {', '.join(names) or 'none'}".lstrip()
