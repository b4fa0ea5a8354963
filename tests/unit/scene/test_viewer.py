"""The interactive window, with one that is none; a machine without a screen says so."""

from __future__ import annotations

import contextlib
import types

import mujoco
import numpy as np
import pytest

from pamsim.comparison.effects_on_rig import movable_effects
from pamsim.core.errors import InputError
from pamsim.engine.rig import load_rig
from pamsim.engine.simulate import simulate
from pamsim.engine.state import reset
from pamsim.recordings.experiment import pressure_step
from pamsim.scene import viewer as viewer_module
from pamsim.scene.pose import muscle_lengths, pose
from pamsim.scene.replay import read_replay
from pamsim.scene.viewer import ArmViewer, watch_live, watch_replay
from tests.unit.scene.films import columns, write

START = (300e3, 100e3)


class FakeWindow:
    """Keeps what MuJoCo's window would show; closes itself after some frames."""

    def __init__(self, model, data, frames):
        self.model, self.data, self.frames = model, data, frames
        self.user_scn = mujoco.MjvScene(model, maxgeom=3000)
        self.cam = mujoco.MjvCamera()
        self.viewport = mujoco.MjrRect(0, 0, 1200, 800)
        self.figures = []
        self.texts = []
        self.shown = []
        self.slider = None
        self.locked = False

    @contextlib.contextmanager
    def lock(self):
        self.locked = True
        yield
        self.locked = False

    def set_figures(self, figures):
        assert not self.locked
        self.figures.append(figures)

    def set_texts(self, texts):
        self.texts.append(texts)

    def sync(self):
        assert not self.locked  # the real one takes the lock itself
        colours = [geom.rgba.tolist() for geom in self.user_scn.geoms[: self.user_scn.ngeom]]
        self.shown.append((self.data.time, self.data.qpos.copy(), colours))
        if self.slider is not None:
            self.data.ctrl[:] = self.slider(len(self.shown))

    def is_running(self):
        return len(self.shown) < self.frames

    def close(self):
        self.frames = 0


class Windows(list):
    """Windows, and how those to come are: of six frames and with nobody at their sliders."""

    frames, slider = 6, None


@pytest.fixture
def windows(monkeypatch):
    opened = Windows()

    def open_window(model, data):
        opened.append(FakeWindow(model, data, opened.frames))
        opened[-1].slider = opened.slider
        return opened[-1]

    monkeypatch.setattr(viewer_module, "open_window", open_window)
    return opened


@pytest.fixture(scope="module")
def rig():
    return load_rig("mas20_arm", scene=True)


@pytest.fixture
def frames_last(monkeypatch):
    """Sets how long a frame lasts [s] by a clock that only its own sleep moves on."""

    def set_clock(step):
        now = [100.0]

        def sleep(_):
            now[0] += step

        clock = types.SimpleNamespace(monotonic=lambda: now[0], sleep=sleep)
        monkeypatch.setattr(viewer_module, "time", clock)

    return set_clock


def test_show_draws_the_state_and_touches_nothing_of_the_simulation(windows, rig):
    model = rig.model_for(load=1.2)
    data = mujoco.MjData(model)
    reset(model, data, START)
    pose(model, data, rig.position_addresses, [0.3])
    before = data.qpos.copy(), data.ctrl.copy(), data.act.copy()
    integrator = model.opt.integrator
    with ArmViewer(model, control_range=(0.0, 6e5)) as viewer:
        (window,) = windows
        window.slider = lambda _: (1e5, 2e5)
        lengths = muscle_lengths(model, data)
        state = {"muscles": rig.muscles, "lengths": lengths}
        for pressure in (0.0, 6e5):
            viewer.show(model, data, pressures=(pressure, 0.0), **state)
        np.testing.assert_array_equal(viewer.controls, (1e5, 2e5))
        np.testing.assert_array_equal(viewer.model.actuator_ctrlrange, [[0.0, 6e5]] * 2)
    for now, then in zip((data.qpos, data.ctrl, data.act), before, strict=True):
        np.testing.assert_array_equal(now, then)
    assert model.opt.integrator == integrator
    (_, position, cold), (_, _, warm) = window.shown
    np.testing.assert_array_equal(position, data.qpos)
    assert len(cold) == len(warm) > 1000  # no geom of the frame before is left
    # The tube of the first muscle takes the blue of its curve.
    assert max(b[2] - a[2] for a, b in zip(cold, warm, strict=True)) > 0.5
    disc = viewer.model.geom("load_disc").id
    assert viewer.model.geom_group[disc] == 5 != model.geom_group[disc]
    mujoco.mj_step(viewer.model, viewer.data)  # with forces it would be NaN
    assert np.isfinite(viewer.data.qpos).all()
    assert not viewer.is_running
    viewer.close()
    viewer.show(model, data, pressures=START, **state)
    assert len(window.shown) == 2


def test_live_rig_keeps_time_and_follows_the_sliders(windows, rig, frames_last):
    windows.frames, windows.slider = 30, lambda _: (100.0, 400.0)  # kPa
    frames_last(0.05)
    watch_live(rig, START, load=1.2)
    (window,) = windows
    times, angles, _ = zip(*window.shown, strict=True)
    np.testing.assert_allclose(times, 0.05 * np.arange(30), atol=rig.model.opt.timestep)
    assert angles[2][0] > angles[0][0]  # towards muscle 1, as the start pressures pull
    assert np.degrees(angles[-1][0]) < -10.0  # and back, as the sliders say
    assert window.model.actuator_ctrlrange[0].tolist() == [0.0, 600.0]
    assert [len(figures) for figures in window.figures] == [3] * 30
    assert "kPa" in window.texts[0][2]


def test_sliders_switch_effects_on_and_off_while_the_arm_moves(windows, rig, frames_last):
    """The slider moves the arm as far as the same load torque does from the start."""
    movable = movable_effects(rig, ["load_torque"])
    assert movable.sizes == {"load_torque": 0.0}
    rests = []
    for size in (0.0, 3.0):
        step = pressure_step(START, START, duration=4.0, load=2.0)
        rests.append(simulate(movable.at({"load_torque": size}), step).completed().angle[-1])

    windows.frames = 180
    windows.slider = lambda shown: (*np.divide(START, 1e3), 3.0 if 60 < shown <= 120 else 0.0)
    frames_last(0.05)
    watch_live(rig, START, load=2.0, effects=movable.sizes, with_effects=movable.at)
    times, angles, _ = zip(*windows[0].shown, strict=True)
    np.testing.assert_allclose(times, 0.05 * np.arange(180), atol=rig.model.opt.timestep)
    assert abs(rests[1] - rests[0]) > np.radians(0.1)
    for frame, rest in ((59, rests[0]), (119, rests[1]), (179, rests[0])):
        # A rest depends a little on where the arm comes from: the rig has hysteresis.
        assert angles[frame][0] == pytest.approx(rest, abs=0.1 * abs(rests[1] - rests[0]))


def test_a_slow_machine_slows_the_arm_down(windows, rig, frames_last):
    frames_last(2.0)
    watch_live(rig, START)
    times = [time for time, _, _ in windows[0].shown]
    np.testing.assert_allclose(np.diff(times), 0.25, atol=rig.model.opt.timestep)


def test_start_pressures_beyond_the_supply_are_refused(windows, rig):
    with pytest.raises(InputError, match=r"muscle_2: 700 kPa is outside \[0, 600\] kPa"):
        watch_live(rig, (300e3, 700e3))
    assert not windows


def test_replay_runs_at_its_speed_and_begins_again(windows, tmp_path, frames_last):
    frames_last(0.15)
    replay = read_replay(write(tmp_path, turn=columns()))
    watch_replay(replay, speed=2.0)
    times, angles, colours = zip(*windows[0].shown, strict=True)
    np.testing.assert_allclose(times, [0.0, 0.3, 0.6, 0.9, 0.2, 0.5], atol=1e-9)
    np.testing.assert_allclose(np.degrees(np.ravel(angles)), [-20, 4, 20, 20, -4, 20], atol=1e-6)
    assert colours[0] != colours[1]
    assert colours[2] == colours[3]
    assert not windows[0].model.nu  # no slider, for nothing can be moved
    assert [figures[0][1].linepnt[0] for figures in windows[0].figures] == [1, 2, 3, 4, 1, 2]
    with pytest.raises(InputError, match="`speed` 0 must be above 0"):
        watch_replay(replay, speed=0.0)
