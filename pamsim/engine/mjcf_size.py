"""The size of the model that an MJCF asks for, before MuJoCo makes it.

A short file can ask for millions of bodies, with which MuJoCo is busy for hours.
"""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree

from pamsim.core.errors import InputError
from pamsim.core.files import read_bounded
from pamsim.core.limits import MJCF_BYTES, MJCF_NUMBERS, MJCF_PARTS, MJCF_PIXELS

_GENERATING = frozenset({"composite", "flexcomp"})
_REPEATING = _GENERATING | {"replicate"}
"""Elements that MuJoCo repeats ``count`` times; several counts are multiplied."""

_INSERTED = frozenset({"include", "model"})
"""Elements that name another MJCF."""

_SIZES = ("njmax", "nconmax", "nuserdata", "nkey", "dim", "actdim", "nsample")
_PER_ELEMENT = "nuser_"
_PLANES = (("width", "height"), ("nrow", "ncol"))


def require_size(mjcf: Path) -> None:
    """Refuse an MJCF that asks for more than `pamsim.core.limits` allow.

    What is not XML, or no number, is left to MuJoCo.

    Args:
        mjcf: the file; those that it includes are counted with it.

    Raises:
        OSError: if it cannot be read.
        InputError: if it asks for more.
    """
    parts = _parts(mjcf, frozenset())
    if parts > MJCF_PARTS:
        raise InputError(
            f"{mjcf} asks for {parts:,.0f} elements, those in replicate, composite and flexcomp"
            f" repeated; a rig has {MJCF_PARTS:,} at most"
        )


def _parts(mjcf: Path, within: frozenset[Path]) -> float:
    if mjcf.resolve() in within:  # an endless chain, which MuJoCo refuses
        return 0.0
    try:
        root = ElementTree.fromstring(read_bounded(mjcf, MJCF_BYTES))
    except ElementTree.ParseError:
        return 0.0
    return _parts_below(root, mjcf, within | {mjcf.resolve()})


def _parts_below(root: ElementTree.Element, mjcf: Path, within: frozenset[Path]) -> float:
    """Elements below one, itself included; by hand, since nesting may be deeper than Python's."""
    parts, open_elements = 0.0, [(root, 1.0)]
    while open_elements:
        element, times = open_elements.pop()
        _require_numbers(element, mjcf)
        inside = times
        if element.tag in _REPEATING:
            inside *= max(1.0, _product(element.get("count", "")))
        file = element.get("file", "")
        if element.tag in _INSERTED and (mjcf.parent / file).is_file():
            parts += times * _parts(mjcf.parent / file, within)
        parts += inside if element.tag in _GENERATING else times
        open_elements += [(child, inside) for child in element]
    return parts


def _require_numbers(element: ElementTree.Element, mjcf: Path) -> None:
    for key, value in element.attrib.items():
        if key in _SIZES or key.startswith(_PER_ELEMENT):
            _require(mjcf, element, f"{key}={value!r}", _product(value), MJCF_NUMBERS)
    for one, other in _PLANES:
        size = _product(f"{element.get(one, '')} {element.get(other, '')}")
        _require(mjcf, element, f"{one} times {other}", size, MJCF_PIXELS)


def _require(mjcf: Path, element: ElementTree.Element, what: str, size: float, most: int) -> None:
    if size > most:
        raise InputError(f"{mjcf}: <{element.tag}> {what} is {size:,.0f}; {most:,} is the most")


def _product(text: str) -> float:
    """Product of the numbers in a text; 1 where there are none."""
    try:
        return math.prod(float(word) for word in text.split())
    except ValueError:
        return 1.0
