"""What the plugin rests on: checked struct offsets, a kernel loaded once, a cache that mends."""

import os
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from pamsim.core.errors import EngineError
from pamsim.engine import plugin, sampling, structs
from pamsim.numba_cache import numba

CODE = """
from pamsim.numba_cache import numba

@numba.njit(cache=True)
def twice(x):
    return 2.0 * x
"""


def test_any_misplaced_field_is_noticed(monkeypatch):
    model, data = plugin.probe()
    right = structs.callback_offsets()
    structs.verify_offsets(model, data)
    for field, offset in right.items():
        wrong = {**right, field: offset + 8}
        monkeypatch.setattr(structs, "callback_offsets", lambda wrong=wrong: wrong)
        with pytest.raises(EngineError, match=field):
            structs.verify_offsets(model, data)
    with pytest.raises(EngineError, match="backend='python'"):
        structs.offset("mjData", "no_such_field")


def test_the_loop_over_samples_is_loaded_from_the_cache_and_not_compiled_in_every_process():
    """Numba makes its cache key from what a function closes over: functions give a new one."""
    closed_over = [cell.cell_contents for cell in sampling.compiled_loop().py_func.__closure__]
    assert closed_over
    assert all(type(value) is str for value in closed_over)


def address(of):
    return of._address


def test_a_kernel_that_does_not_load_gives_no_number_and_is_reported(monkeypatch, capsys):
    model, data = plugin.probe()

    def failing():
        raise EngineError("no such engine")

    monkeypatch.setattr(plugin, "load_kernel", failing)
    assert not plugin.loaded(address(model), address(data))
    assert np.isnan(data.actuator_force[: model.nactuator]).all()
    assert capsys.readouterr().err == "pamsim: the muscles cannot be evaluated: no such engine\n"


def test_another_declaration_of_plugins_is_refused(monkeypatch):
    plugin.check_declaration()
    fewer = [name for name in plugin.FIELDS if name != "advance"]
    monkeypatch.setattr(plugin, "FIELDS", fewer)
    with pytest.raises(EngineError, match="declares plugins in another way"):
        plugin.check_declaration()


def test_a_damaged_file_of_the_cache_is_made_again(tmp_path, monkeypatch):
    file, module = tmp_path / "twice.py", ModuleType("twice")
    file.write_text(CODE, encoding="utf-8")
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setitem(sys.modules, "twice", module)  # where a cached function looks for its own

    def found_in_cache():
        """As in a new process: the function is made again, and knows nothing of the last one."""
        exec(compile(CODE, file, "exec"), vars(module))
        assert module.twice(2.0) == 4.0
        return bool(module.twice.stats.cache_hits)

    assert not found_in_cache()
    other = b"\x80\x05\x96" + b"\xff" * 8  # pickle: an array of bytes of that length
    for end, size in (("nbi", 12), ("nbc", 200)):  # index and code
        for damage in (
            lambda file, size=size: os.truncate(file, size),
            lambda file: file.write_bytes(other),
            Path.unlink,
        ):
            (cached,) = tmp_path.rglob(f"*.{end}")
            damage(cached)
            assert not found_in_cache(), end
    assert found_in_cache()
