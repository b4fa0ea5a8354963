"""What the plugin rests on: checked struct offsets, a cache key that sees laws."""

from __future__ import annotations

import sys
import types

import mujoco
import numpy as np
import pytest

from pamsim.core.errors import EngineError
from pamsim.engine import plugin, sampling, structs
from pamsim.engine.jit import fingerprint, reached_functions
from tests.unit.physics.flat import kernel

TINY = """<mujoco>
<extension><plugin plugin='pamsim.muscle'><instance name='p'/></plugin></extension>
<worldbody><body><joint name='j'/><geom size='1'/></body>
<body><joint name='b' type='ball'/><geom size='1'/></body></worldbody>
<actuator><general joint='j' dyntype='integrator' user='1 2 3'/><orientation joint='b'/>
<motor joint='j'/></actuator></mujoco>"""


@pytest.mark.parametrize("field", sorted(structs.callback_offsets()))
def test_any_misplaced_field_is_noticed(monkeypatch, field):
    plugin.register()
    model = mujoco.MjModel.from_xml_string(TINY)
    data = mujoco.MjData(model)
    data.time = 0.125
    model.opt.integrator, model.opt.disableactuator = 3, 5
    structs.verify_offsets(model, data)
    wrong = {**structs.callback_offsets(), field: structs.callback_offsets()[field] + 8}
    monkeypatch.setattr(structs, "callback_offsets", lambda: wrong)
    with pytest.raises(EngineError, match=field):
        structs.verify_offsets(model, data)


def test_unknown_field_names_the_remedy():
    with pytest.raises(EngineError, match="backend='python'"):
        structs.offset("mjData", "no_such_field")


def test_every_law_of_the_kernel_is_reached():
    names = {f.__name__ for f in reached_functions(kernel.state_rates, kernel.tension)}
    assert {
        "six_parameter_volume",
        "flow_function",
        "tube_force",
        "taut",
        "absolute_pressure",
    } <= names
    assert "pack" not in names


def _copy(function, source_globals):
    return types.FunctionType(function.__code__, source_globals, function.__name__)


def test_cache_key_changes_with_a_number_a_law_takes_from_its_module():
    from pamsim.physics import orifice

    before = fingerprint([orifice.mass_flow])
    changed = _copy(orifice.mass_flow, {**vars(orifice), "REFERENCE_DENSITY": 1.2})
    changed.__wrapped__ = orifice.mass_flow  # source is read through this
    assert fingerprint([changed]) != before


def test_cache_key_changes_with_the_text_of_a_law(tmp_path):
    import importlib.util

    def load(text):
        path = tmp_path / f"law_{abs(hash(text))}.py"
        path.write_text(text)
        spec = importlib.util.spec_from_file_location(path.stem, path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module.law

    same = [fingerprint([load("def law(x):\n    return x + 1.0\n")]) for _ in range(2)]
    assert same[0] == same[1]
    assert fingerprint([load("def law(x):\n    return x + 2.0\n")]) != same[0]


def test_the_loop_over_samples_is_loaded_from_the_cache_and_not_compiled_in_every_process():
    """Numba makes its cache key from what a function closes over: functions give a new one."""
    closed_over = [cell.cell_contents for cell in sampling._loop().py_func.__closure__]
    assert closed_over
    assert all(type(value) is int for value in closed_over)


def address(of):
    return of._address


def test_a_kernel_that_does_not_load_gives_no_number_and_is_reported(monkeypatch):
    model = mujoco.MjModel.from_xml_string(TINY)
    data = mujoco.MjData(model)
    reported = []

    def failing():
        raise EngineError("no such engine")

    monkeypatch.setattr(plugin, "load_kernel", failing)
    monkeypatch.setattr(sys, "unraisablehook", reported.append)
    plugin.first_forces(address(model), address(data), 0, 1)
    assert np.isnan(data.actuator_force[: model.nactuator]).all()
    assert str(reported[0].exc_value) == "no such engine"


def test_another_declaration_of_plugins_is_refused(monkeypatch):
    plugin.check_declaration()
    fewer = {name: kind for name, kind in plugin.FIELDS.items() if name != "advance"}
    monkeypatch.setattr(plugin, "FIELDS", fewer)
    with pytest.raises(EngineError, match="declares plugins in another way"):
        plugin.check_declaration()
