"""What the plugin rests on: checked struct offsets, and a kernel that is loaded once."""

from __future__ import annotations

import numpy as np
import pytest

from pamsim.core.errors import EngineError
from pamsim.engine import plugin, sampling, structs


@pytest.mark.parametrize("field", sorted(structs.callback_offsets()))
def test_any_misplaced_field_is_noticed(monkeypatch, field):
    model, data = plugin.probe()
    structs.verify_offsets(model, data)
    wrong = {**structs.callback_offsets(), field: structs.callback_offsets()[field] + 8}
    monkeypatch.setattr(structs, "callback_offsets", lambda: wrong)
    with pytest.raises(EngineError, match=field):
        structs.verify_offsets(model, data)


def test_unknown_field_names_the_remedy():
    with pytest.raises(EngineError, match="backend='python'"):
        structs.offset("mjData", "no_such_field")


def test_the_loop_over_samples_is_loaded_from_the_cache_and_not_compiled_in_every_process():
    """Numba makes its cache key from what a function closes over: functions give a new one."""
    closed_over = [cell.cell_contents for cell in sampling.compiled_loop().py_func.__closure__]
    assert closed_over
    assert all(type(value) is int for value in closed_over)


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
