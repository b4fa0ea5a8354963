"""The raw samples of a run, the first at which it broke down, and the engine's warnings of it."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from pamsim.recordings.recording import Outcome

FloatArray: TypeAlias = NDArray[np.float64]

_lock = threading.Lock()
_holders: list[object] = []


@dataclass(frozen=True)
class Trace:
    """Signals of the engine at every sample, before the next step.

    Attributes:
        time: (n,) engine time [s].
        position: (n, nq) ``qpos``.
        velocity: (n, nv) ``qvel``.
        act: (n, na) states of all actuators.
        length: (n, m) actuator lengths [m].
        speed: (n, m) their rates [m/s].
        force: (n, m) actuator forces [N].
        effort: (n, j) what acts on driven joints from outside [N m or N].
        warnings: (n, k) how often the engine has warned of each kind.
    """

    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    act: FloatArray
    length: FloatArray
    speed: FloatArray
    force: FloatArray
    effort: FloatArray
    warnings: NDArray[np.int32]


def empty_trace(model: mujoco.MjModel, samples: int, driven: int = 0) -> Trace:
    """A trace with room for a number of samples, of a number of driven joints."""
    return Trace(
        time=np.empty(samples),
        position=np.empty((samples, model.nq)),
        velocity=np.empty((samples, model.nv)),
        act=np.empty((samples, model.na)),
        length=np.empty((samples, model.nactuator)),
        speed=np.empty((samples, model.nactuator)),
        force=np.empty((samples, model.nactuator)),
        effort=np.empty((samples, driven)),
        warnings=np.empty((samples, int(mujoco.mjtWarning.mjNWARNING)), dtype=np.int32),
    )


def first_breakdown(
    trace: Trace, expected_time: FloatArray, slack: float, first: int, last: int
) -> tuple[int, Outcome, str] | None:
    """The first sample at which the state is invalid, if there is one.

    The engine itself only prints a warning and goes on.

    Args:
        trace: of the run.
        expected_time: (n,) engine time that belongs to each sample [s].
        slack: difference from it that rounding explains [s].
        first: sample to begin at.
        last: sample to stop before.

    Returns:
        Its number, what it is called, and the reason as a phrase.
    """
    rows = slice(first, last)
    states = np.concatenate([trace.act[rows], trace.position[rows]], axis=1)
    healthy = (
        np.isfinite(states).all(axis=1)
        & ~trace.warnings[rows].any(axis=1)
        & (np.abs(trace.time[rows] - expected_time[rows]) <= slack)
    )
    broken = np.flatnonzero(np.logical_not(healthy))
    if not len(broken):
        return None
    sample = first + int(broken[0])
    if not np.isfinite(states[broken[0]]).all():
        return (
            sample,
            Outcome.NOT_FINITE,
            "a state is not finite; check parameters and start pressures, or take a smaller time"
            " step",
        )
    warned = np.flatnonzero(trace.warnings[sample])
    if len(warned):
        kind = mujoco.mjtWarning(int(warned[0])).name.removeprefix("mjWARN_")
        return (
            sample,
            Outcome.ENGINE_WARNING,
            f"MuJoCo warned of {kind}; take a smaller time step",
        )
    return (
        sample,
        Outcome.TIME_STALLED,
        f"time is {trace.time[sample]:.6g} s, not {expected_time[sample]:.6g} s",
    )


@contextlib.contextmanager
def engine_warnings_held() -> Iterator[None]:
    """Let the engine print no warnings, and write no ``MUJOCO_LOG.TXT``, in a ``with`` block.

    It counts them all the same, and a run that has one reports it as its outcome. A handler that
    somebody has set by ``mujoco.set_mju_user_warning`` is left alone. It holds for the process.
    """
    holder = object()
    with _lock:
        if not _holders and mujoco.get_mju_user_warning() is None:
            mujoco.set_mju_user_warning(_held)
        _holders.append(holder)
    try:
        yield
    finally:
        with _lock:
            _holders.remove(holder)
            if not _holders and mujoco.get_mju_user_warning() is _held:
                mujoco.set_mju_user_warning(None)


def _held(_: str) -> None:
    """Take a warning of the engine and do nothing with it."""
