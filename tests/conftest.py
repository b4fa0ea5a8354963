"""What holds for every test: no window, every step checked, no leftovers in the process."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from types import ModuleType

import hypothesis
import pytest


def _has_egl() -> bool:
    try:
        ctypes.CDLL("libEGL.so.1")
    except OSError:
        return False
    return True


# Before anything imports them: figures without a window, and pictures of MuJoCo without a screen.
# `import mujoco` itself fails if it is to use an EGL that is not installed, hence this check first.
os.environ.setdefault("MPLBACKEND", "Agg")
if sys.platform == "linux":
    os.environ.setdefault("MUJOCO_GL", "egl" if _has_egl() else "disable")

# Every step of every simulation, see `pamsim.checks`; tests of commands leave that out again.
os.environ["PAMSIM_CHECK"] = "1"

# The same examples in every run: a failure here is a failure everywhere. A first call may compile a
# law, which takes seconds: the time of one example is no measure.
hypothesis.settings.register_profile(
    "pamsim", derandomize=True, deadline=None, database=None, max_examples=60
)
hypothesis.settings.load_profile("pamsim")


def installed_callbacks(mujoco: ModuleType) -> list[str]:
    """Names of the callbacks that are set in the process, such as ``mjcb_act_gain``."""
    return [
        name.removeprefix("get_")
        for name in dir(mujoco)
        if name.startswith("get_mjcb_") and getattr(mujoco, name)() is not None
    ]


@pytest.fixture(autouse=True)
def no_callback_left_behind() -> Iterator[None]:
    """Fail the test that leaves a MuJoCo callback installed.

    The callbacks belong to the process, not to a model: one left behind would add muscle forces to
    the models of every later test.
    """
    yield
    mujoco = sys.modules.get("mujoco")
    if mujoco is None:
        return
    left = installed_callbacks(mujoco)
    for name in left:  # so that only the guilty test fails, not all that follow it
        getattr(mujoco, f"set_{name}")(None)
    assert not left, f"this test left MuJoCo callbacks installed: {', '.join(left)}"


@pytest.fixture(autouse=True)
def every_step_is_possible() -> Iterator[None]:
    """Fail the test whose steps have reached a state that cannot be, unless that was raised."""
    yield
    checks = sys.modules.get("pamsim.engine.checks")
    if checks is not None:
        checks.raise_found()


@pytest.fixture(scope="module")
def rig():
    """The MAS-20 arm as shipped; a file about another rig has a fixture of its own."""
    import pamsim

    return pamsim.load_rig("mas20_arm")


@pytest.fixture
def unchecked() -> Iterator[None]:
    """For tests of what a run does that breaks down: with the checks it ends in an error."""
    from pamsim.engine.checks import checks

    with checks(False):
        yield


@pytest.fixture(scope="module")
def catalogs_as_before() -> Iterator[None]:
    """After a file whose tests add laws, the catalogs are as other tests know them."""
    from pamsim.physics.force_laws.catalog import FORCE_LAWS
    from pamsim.physics.hysteresis.catalog import OPERATORS
    from pamsim.recordings import rig_file

    kept = [
        (one, {n: v.copy() for n, v in vars(one).items() if isinstance(v, dict)})
        for one in (FORCE_LAWS, OPERATORS)
    ]
    yield
    for one, dicts in kept:
        vars(one).update(dicts)
    rig_file._own_physics.cache_clear()
