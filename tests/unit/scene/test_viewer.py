"""A recording replayed in pictures, and the interactive window, with one that is none."""

import contextlib
import math
import types

import mujoco
import numpy as np
import pytest

from pamsim.comparison.effects_on_rig import movable_effects
from pamsim.engine.rig import load_rig
from pamsim.engine.simulate import simulate
from pamsim.engine.state import reset
from pamsim.recordings.experiment import pressure_step
from pamsim.scene import viewer as viewer_module
from pamsim.scene.pose import muscle_lengths, pose
from pamsim.scene.replay import arm_camera, frame_times, read_replay
from pamsim.scene.viewer import ArmViewer, watch_live, watch_replay
from tests.unit.core.refusals import refused
from tests.unit.scene.films import TIME, columns, nearest_series, needs_gl, write

START = (300e3, 100e3)
SIZE = {"width": 240, "height": 150}


def test_a_film_lasts_as_long_as_fps_and_speed_say():
    for fps, speed in ((25.0, 1.0), (30.0, 0.5), (12.5, 4.0), (1.0, 100.0)):
        times = frame_times(4.0, fps=fps, speed=speed)
        assert times[0] == 0.0
        assert times[-1] < 4.0
        assert len(times) / fps == pytest.approx(4.0 / speed, abs=1.0 / fps)
        np.testing.assert_allclose(np.diff(times), speed / fps)
    for pace in ({"fps": 0.0, "speed": 1.0}, {"fps": 25.0, "speed": math.nan}):
        with refused("must be above 0"):
            frame_times(4.0, **pace)


def test_a_trial_is_found_by_name_and_read_between_its_samples(tmp_path):
    folder = write(tmp_path, one=columns(), two=columns(angle_deg=0.0 * TIME))
    replay = read_replay(folder)
    assert (replay.trial.name, replay.duration) == ("one", TIME[-1])
    assert math.degrees(replay.positions(0.255)[0]) == pytest.approx(0.4)
    assert replay.pressures(0.255) == pytest.approx([304e3, 296e3])
    chosen = read_replay(folder, trial="two")
    assert (chosen.trial.name, chosen.others) == ("two", ("one",))
    with refused("did you mean 'two'"):
        read_replay(folder, trial="tow")
    with refused("no camera 'sky'"), arm_camera(chosen, camera="sky", **SIZE):
        pass
    with refused("no column 'angle_deg'"):
        read_replay(write(tmp_path / "blind", turn=columns(angle_deg=None)))
    with refused("is of 1 muscles, rig 'mas20_arm' has 2"):
        read_replay(write(tmp_path / "single", turn=columns(p2_set_kpa=None, p2_kpa=None)))


@needs_gl
def test_equal_states_give_equal_pixels_and_a_turned_arm_others(tmp_path):
    held = columns(p1_kpa=300.0 + 0.0 * TIME, p2_kpa=300.0 + 0.0 * TIME)
    with arm_camera(read_replay(write(tmp_path, turn=held)), **SIZE) as arm:
        start, middle, rest = (arm.draw(time).astype(int) for time in (0.0, 0.25, 0.6))
        assert start.shape == (150, 240, 3)
        np.testing.assert_array_equal(arm.draw(0.9), rest)
        np.testing.assert_array_equal(arm.draw(0.0), start)
    for one, other in ((start, middle), (middle, rest)):
        moved = np.abs(one - other).max(axis=2) > 40
        assert 0.005 < moved.mean() < 0.3


@needs_gl
def test_a_muscle_takes_the_colour_of_its_curve_as_its_pressure_rises(tmp_path):
    held = columns(angle_deg=0.0 * TIME, p2_kpa=None, p1_kpa=600.0 * TIME)
    with arm_camera(read_replay(write(tmp_path, turn=held)), camera="top", **SIZE) as arm:
        cold, warm = (arm.draw(time).astype(int) for time in (0.0, 1.0))
        labels = arm.labels
    changed = np.abs(warm - cold).sum(axis=2) > 60
    rows, found = np.nonzero(changed)
    assert len(rows) > 50
    assert (rows < SIZE["height"] / 2).all()  # from above, muscle 1 lies in the upper half
    assert nearest_series((warm - cold)[changed].mean(axis=0)) == 0
    # The label stands where the coloured part begins.
    column, row = labels["muscle_1"]
    assert found.min() == pytest.approx(column, abs=0.05 * SIZE["width"])
    assert rows.mean() == pytest.approx(row, abs=2.0)
    # Muscle 2, whose pressure nobody measured, lies below and is grey.
    column, row = (round(value) for value in labels["muscle_2"])
    grey = warm[row - 1 : row + 2, column + 25 : column + 60].reshape(-1, 3)
    assert np.ptp(grey.mean(axis=0)) < 12.0


class FakeWindow:
    """Keeps what MuJoCo's window would show; closes itself after some frames."""

    def __init__(self, model, data, frames, slider):
        self.model, self.data, self.frames, self.slider = model, data, frames, slider
        self.user_scn = mujoco.MjvScene(model, maxgeom=3000)
        self.cam = mujoco.MjvCamera()
        self.viewport = mujoco.MjrRect(0, 0, 1200, 800)
        self.figures, self.texts, self.shown = [], [], []
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
        opened.append(FakeWindow(model, data, opened.frames, opened.slider))
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
    integrator, windows.slider = model.opt.integrator, lambda _: (1e5, 2e5)
    state = {"muscles": rig.muscles, "lengths": muscle_lengths(model, data)}
    with ArmViewer(model, control_range=(0.0, 6e5)) as viewer:
        (window,) = windows
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


def test_sliders_move_pressures_and_effects_while_the_arm_keeps_time(windows, rig, frames_last):
    """The slider of an effect moves the arm as far as the same load torque does from the start."""
    movable = movable_effects(rig, ["load_torque"])
    assert movable.sizes == {"load_torque": 0.0}
    rests = []
    for size in (0.0, 3.0):
        step = pressure_step(START, START, duration=3.0, load=2.0)
        rests.append(simulate(movable.at({"load_torque": size}), step).completed().angle[-1])
    apart = abs(rests[1] - rests[0])
    assert apart > np.radians(0.1)

    def slider(shown):
        if shown > 90:
            return 100.0, 400.0, 0.0  # kPa
        return *np.divide(START, 1e3), 3.0 if shown > 45 else 0.0

    windows.frames, windows.slider = 105, slider
    frames_last(0.05)
    watch_live(rig, START, load=2.0, effects=movable.sizes, with_effects=movable.at)
    (window,) = windows
    times, angles, _ = zip(*window.shown, strict=True)
    np.testing.assert_allclose(times, 0.05 * np.arange(105), atol=rig.model.opt.timestep)
    assert angles[2][0] > angles[0][0]  # towards muscle 1, as the start pressures pull
    for frame, rest in ((44, rests[0]), (89, rests[1])):
        # A rest depends a little on where the arm comes from: the rig has hysteresis.
        assert angles[frame][0] == pytest.approx(rest, abs=0.1 * apart)
    assert angles[-1][0] < angles[89][0] - 10.0 * apart  # and back, as the sliders say
    assert window.model.actuator_ctrlrange[0].tolist() == [0.0, 600.0]
    assert [len(figures) for figures in window.figures] == [3] * 105
    assert "kPa" in window.texts[0][2]


def test_a_slow_machine_slows_the_arm_down_and_the_supply_bounds_its_start(
    windows, rig, frames_last
):
    with refused("muscle_2: 700 kPa is outside [0, 600] kPa"):
        watch_live(rig, (300e3, 700e3))
    assert not windows
    frames_last(2.0)
    watch_live(rig, START)
    times = [time for time, _, _ in windows[0].shown]
    np.testing.assert_allclose(np.diff(times), 0.25, atol=rig.model.opt.timestep)


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
    with refused("`speed` 0 must be above 0"):
        watch_replay(replay, speed=0.0)
