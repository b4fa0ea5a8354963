"""Whether the elements of a MATLAB file (MAT 5) are whole: scipy trusts them, and may crash.

A file is a header of 128 bytes and data elements: a tag with type and size, then the bytes. An
array is an element that consists of others: flags, dimensions, name, values. Source: "MAT-File
Format", The MathWorks, chapter 1.
"""

from __future__ import annotations

import struct
import zlib

HEADER = 128
_MATRIX, _COMPRESSED = 14, 15
_NUMBERS = frozenset({1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18})
"""Types of elements that hold numbers or characters."""

MOST_INFLATED = 1 << 30
"""Bytes that a compressed array may have, and a file's arrays together."""

DEEPEST = 20
"""Cells in cells, or structures in structures."""


def check_elements(content: bytes) -> None:
    """Check that every element of a MAT 5 file has a type that exists and lies inside its parent.

    Args:
        content: the file. One of another version is left to the reader.

    Raises:
        ValueError: if not, or if the arrays are too large or too deep.
    """
    order = {b"IM": "<", b"MI": ">"}.get(content[HEADER - 2 : HEADER])
    if order is None or 0 in content[:4]:  # four zero-free bytes set MAT 5 apart from MAT 4
        return
    left = MOST_INFLATED
    at = HEADER
    while at < len(content):
        kind, start, end, at = _element(content, at, len(content), order)
        whole = content[start:end]
        if kind == _COMPRESSED:
            whole = _inflated(whole, left)
            left -= len(whole)
            kind, start, end, _ = _element(whole, 0, len(whole), order)
            whole = whole[start:end]
        if kind != _MATRIX:
            raise ValueError(f"data element of type {kind} where an array should be")
        _check_array(whole, order, 0)


def _element(content: bytes, at: int, end: int, order: str) -> tuple[int, int, int, int]:
    """Type, start and end of the data of the element at some place, and where the next one is."""
    if at + 8 > end:
        raise ValueError("it ends in the middle of an array")
    kind, size = struct.unpack_from(f"{order}II", content, at)
    if kind >> 16:  # four bytes at most, inside the tag
        kind, size, start, following = kind & 0xFFFF, kind >> 16, at + 4, at + 8
        if size > 4:
            raise ValueError(f"a short data element of {size} bytes")
    else:
        start = at + 8
        following = start + (size if kind == _COMPRESSED else -(-size // 8) * 8)
    if start + size > end:
        raise ValueError("it ends in the middle of an array")
    return kind, start, start + size, following


def _inflated(content: bytes, most: int) -> bytes:
    try:
        whole = zlib.decompressobj().decompress(content, most)
    except zlib.error as error:
        raise ValueError(f"a compressed array is damaged ({error})") from None
    if len(whole) >= most:
        raise ValueError(f"its arrays are larger than {MOST_INFLATED} bytes")
    return whole


def _check_array(content: bytes, order: str, depth: int) -> None:
    """Check the elements of an array, and of the arrays in it."""
    if depth > DEEPEST:
        raise ValueError(f"arrays more than {DEEPEST} deep in each other")
    at = 0
    while at < len(content):
        kind, start, end, at = _element(content, at, len(content), order)
        if kind == _MATRIX:
            _check_array(content[start:end], order, depth + 1)
        elif kind not in _NUMBERS:
            raise ValueError(f"a data element of unknown type {kind}")
