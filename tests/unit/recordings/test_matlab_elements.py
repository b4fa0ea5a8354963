"""A damaged MATLAB file is refused before scipy, which would crash, reads it."""

from __future__ import annotations

import io
import struct
import zlib

import numpy as np
import pytest
import scipy.io
import scipy.sparse

from pamsim.core.errors import InputError
from pamsim.recordings.array_files import read_arrays
from pamsim.recordings.matlab_elements import HEADER, check_elements

LOG = {
    "t": np.arange(5) * 0.01,
    "cell": np.array([np.ones(3), "text"], dtype=object),
    "structure": {"angle": np.ones((2, 2)), "name": "knee", "whole": np.int16(3)},
    "z": np.array([1.0 + 2.0j]),
    "large": np.zeros((100, 100)),
    "none": np.zeros((0, 3)),
}


def saved(log, **options):
    stream = io.BytesIO()
    scipy.io.savemat(stream, log, **options)
    return stream.getvalue()


@pytest.mark.parametrize("compressed", [False, True])
def test_whole_files_pass(compressed):
    check_elements(saved(LOG, do_compression=compressed))
    check_elements(saved({"t": np.arange(5.0)}, format="4"))


def test_every_type_that_does_not_exist_is_refused():
    content = saved({"t": np.arange(50.0)})
    # The tag of the values: after those of flags, dimensions and name.
    at = content.index(struct.pack("<II", 9, 400))
    for kind in (0, 8, 10, 11, 15, 19, 200):
        damaged = content[:at] + struct.pack("<I", kind) + content[at + 4 :]
        with pytest.raises(ValueError, match=f"unknown type {kind}"):
            check_elements(damaged)


@pytest.mark.parametrize("array", [np.arange(50.0), scipy.sparse.csc_array(np.eye(20))])
def test_an_array_said_to_be_complex_without_imaginary_part_is_refused(array):
    content = bytearray(saved({"t": array}))
    flags = content.index(struct.pack("<II", 6, 8)) + 8
    content[flags + 1] |= 0x08
    with pytest.raises(ValueError, match=r"an array of [46] data elements where .* ask for [57]"):
        check_elements(bytes(content))
    check_elements(saved({"t": array * (1.0 + 2.0j)}))


@pytest.mark.parametrize("size", [HEADER + 4, HEADER + 20, -8, -100])
def test_a_file_cut_off_is_refused(size):
    with pytest.raises(ValueError, match="ends in the middle"):
        check_elements(saved(LOG)[:size])


def test_what_inflates_without_end_is_refused(monkeypatch):
    monkeypatch.setattr("pamsim.recordings.matlab_elements.ARRAY_BYTES", 10_000)
    with pytest.raises(ValueError, match="larger than 10000 bytes"):
        check_elements(saved(LOG, do_compression=True))


def test_nested_without_end_is_refused():
    inner = b""
    for _ in range(30):
        inner = struct.pack("<II", 14, len(inner)) + inner
    with pytest.raises(ValueError, match="more than 20 deep"):
        check_elements(saved({})[:HEADER] + inner)
    packed = zlib.compress(inner)
    with pytest.raises(ValueError, match="more than 20 deep"):
        check_elements(saved({})[:HEADER] + struct.pack("<II", 15, len(packed)) + packed)


def test_the_reader_says_which_file(tmp_path):
    path = tmp_path / "log.mat"
    path.write_bytes(saved(LOG)[:-8])
    with pytest.raises(InputError, match=r"log\.mat cannot be read as \.mat: it ends in the mid"):
        read_arrays(path)
