"""Whether the elements of a MATLAB file (MAT 5) are whole: scipy trusts them, and may crash.

A file is a header of 128 bytes and data elements: a tag with type and size, then the bytes. An
array is an element that consists of others: flags, dimensions, name, values. Source: "MAT-File
Format", The MathWorks, chapter 1.
"""

from __future__ import annotations

import struct
import zlib

from pamsim.core.limits import ARRAY_BYTES, ARRAY_DEPTH

HEADER = 128
_MATRIX, _COMPRESSED = 14, 15
_NUMBERS = frozenset({1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18})
"""Types of elements that hold numbers or characters."""

_SPARSE, _COMPLEX = 5, 0x0800
_ARRAYS_OF_NUMBERS = frozenset({4, *range(6, 16)})
"""Classes of arrays in the first of their elements, the flags."""


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
    left = ARRAY_BYTES
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
        raise ValueError(f"its arrays are larger than {ARRAY_BYTES} bytes")
    return whole


def _check_array(content: bytes, order: str, depth: int) -> None:
    """Check the elements of an array, and of the arrays in it."""
    if depth > ARRAY_DEPTH:
        raise ValueError(f"arrays more than {ARRAY_DEPTH} deep in each other")
    at, count, least = 0, 0, 0
    while at < len(content):
        kind, start, end, at = _element(content, at, len(content), order)
        if count == 0 and end - start >= 4:
            least = _least_elements(struct.unpack_from(f"{order}I", content, start)[0])
        count += 1
        if kind == _MATRIX:
            _check_array(content[start:end], order, depth + 1)
        elif kind not in _NUMBERS:
            raise ValueError(f"a data element of unknown type {kind}")
    if count < least:
        raise ValueError(f"an array of {count} data elements where its flags ask for {least}")


def _least_elements(flags: int) -> int:
    """Elements that an array of numbers has at least: scipy reads on where they are missing."""
    kind = flags & 0xFF
    if kind in _ARRAYS_OF_NUMBERS:  # flags, dimensions, name, values
        least = 4
    elif kind == _SPARSE:  # and rows and columns of the values
        least = 6
    else:
        return 0
    return least + 1 if flags & _COMPLEX else least
