"""Positions at rest of a rig, from the balance of its torques without simulating in time.

A position at rest depends neither on the valves nor on the damping, so that hundreds of rigs can be
compared in the time that one simulated response takes. What depends on the path is left out: dry
friction, the hysteresis of the muscles, their creep (relaxed at rest) and backlash.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import mujoco
import numpy as np
import scipy.optimize

from pamsim.core.errors import InputError
from pamsim.core.units import FloatArray
from pamsim.engine.mjcf import measure_tendons, scalar_joints, sparse_moments
from pamsim.engine.rig import Rig
from pamsim.engine.stepping import muscle_ids
from pamsim.physics.chain import chain_length, chain_ratio, steady_extension
from pamsim.physics.learned import learned_force, learns
from pamsim.physics.record import Parameters, view
from pamsim.physics.static_muscle import limited, static_force
from pamsim.physics.tension import taut

Torques: TypeAlias = Callable[[Sequence[float] | FloatArray, Sequence[float]], list[float]]
# scipy carries no types: what it returns is Any at this file's boundary.
_root: Any = scipy.optimize.brentq

_STRIDE = 0.1  # longest step of the search for a balance [rad]
_FARTHEST = 3.0  # angle beyond which no balance is searched [rad]
_NEAR = 1e-9  # rad
_SLACK = 1e-9  # torque that counts as none [N m]: it turns no arm
_TURN = 1e-5  # rad or m, for derivatives
_MOST_STEPS = 200
_DOUBLINGS = 5
_TAUT = 1e-7  # N, of the force in a chain that gives


def rest_angles(
    rig: Rig, pressure: FloatArray, load: FloatArray, near: FloatArray | None = None
) -> FloatArray:
    """Angles at which an arm comes to rest.

    The arm goes where the torque drives it, to the first balance, or to the joint's stop.

    Args:
        rig: of one joint.
        pressure: (n, m) gauge pressures at rest [Pa].
        load: (n,) mass on the arm [kg].
        near: (n,) angles from which it goes [rad], the nearer the quicker; 0 if left out.

    Returns:
        (n,) angles [rad]; NaN for a row without a balance.

    Raises:
        InputError: if the rig has more than one degree of freedom.
    """
    if rig.model.nv != 1:
        raise InputError(
            f"rig {rig.name!r} has {rig.model.nv} degrees of freedom; angles at rest are solved for"
            " arms of one joint"
        )
    angle = np.full(len(pressure), np.nan)
    begin = np.zeros(len(pressure)) if near is None else near
    stride = _STRIDE if near is None else _STRIDE / 10.0
    (low,), (high,) = _stops(rig.model)
    data = mujoco.MjData(rig.model)  # serves all loads: their models are of one size
    for mass in np.unique(load):
        torques = still_torques(rig, float(mass), data)
        for i in np.flatnonzero(load == mass):
            at = min(max(float(begin[i]), low), high)
            angle[i] = _first_balance(torques, pressure[i].tolist(), at, stride, (low, high))
    return angle


def _first_balance(
    torques: Torques, held: list[float], near: float, stride: float, stops: tuple[float, float]
) -> float:
    """First angle from one on at which the torque of an arm vanishes [rad]; NaN if none does."""

    def torque(angle: float) -> float:
        return torques((angle,), held)[0]

    driven = torque(near)
    if abs(driven) < _SLACK:
        return near
    way = float(np.sign(driven))
    stop = stops[way > 0.0]
    while abs(near) < _FARTHEST and np.isfinite(driven):
        far = near + way * min(stride, abs(stop - near))
        driven = torque(far)
        if way * driven < _SLACK:
            # Where muscles go slack the torque is 0 from there on.
            return float(_root(lambda at: torque(at) - way * _SLACK, near, far, xtol=_NEAR))
        if far == stop:
            return stop
        near, stride = far, min(2.0 * stride, _STRIDE)
    return float("nan")


def rest_positions(rig: Rig, pressure: FloatArray, near: FloatArray) -> FloatArray:
    """Positions at which a rig without load comes to rest, for any number of joints.

    The search steps from a position towards the balance of the linearised rig, as far as joints
    with a range may go.

    Args:
        rig: whose joints turn about one axis or slide along one.
        pressure: (m,) gauge pressures at rest [Pa].
        near: (nv,) positions from which it goes [rad or m].

    Returns:
        (nv,) positions [rad or m]; NaN if no balance is found.

    Raises:
        InputError: if a joint is free or a ball.
    """
    model = rig.model
    if len(scalar_joints(model)) < model.njnt:
        raise InputError(f"rig {rig.name!r} has a free or ball joint: it has no position at rest")
    torques, held = still_torques(rig, 0.0, mujoco.MjData(model)), pressure.tolist()

    def balance(where: FloatArray) -> FloatArray:
        return np.array(torques(where, held))

    low, high = _stops(model)
    at = np.clip(near, low, high)
    for _ in range(_MOST_STEPS):
        torque = balance(at)
        free = ~((at <= low) & (torque < 0.0) | (at >= high) & (torque > 0.0))
        slope = _slope(balance, at)
        step = np.zeros(len(at))
        try:
            step[free] = np.linalg.solve(-slope[np.ix_(free, free)], torque[free])
        except np.linalg.LinAlgError:  # nothing holds the rig here, as with slack muscles
            step[free] = torque[free]
        if step @ torque < 0.0:  # a balance that the rig leaves: go where it is driven
            step = np.where(free, torque, 0.0)
        step *= min(1.0, _STRIDE / max(float(np.abs(step).max()), _STRIDE))
        new = np.clip(at + step, low, high)
        if np.abs(new - at).max() < _NEAR:
            return new
        at = new
    return np.full(len(at), np.nan)


def _stops(model: mujoco.MjModel) -> FloatArray:
    """Least and greatest position of each joint that turns or slides (2, nv) [rad or m]."""
    ends = np.where(model.jnt_limited[:, None] != 0, model.jnt_range, (-np.inf, np.inf))
    return ends.T


def _slope(values: Callable[[FloatArray], FloatArray], at: FloatArray) -> FloatArray:
    """Derivatives of values by all positions, a column each."""
    turns = _TURN * np.eye(len(at))
    ahead, behind = (np.array([values(at + side * turn) for turn in turns]) for side in (1, -1))
    return ((ahead - behind) / (2.0 * _TURN)).T


def still_torques(rig: Rig, load: float, data: mujoco.MjData) -> Torques:
    """Torques on the joints [N m or N] of a rig at rest.

    Args:
        rig: the rig.
        load: mass on it [kg].
        data: of the rig's model, overwritten at every call.

    Returns:
        Function of positions (nq,) [rad or m] and gauge pressures (m,) [Pa]; (nv,).
    """
    model = rig.model_for(load=load)
    muscles = [
        (view(model.actuator_user[i]), int(model.actuator_trnid[i, 0])) for i in muscle_ids(model)
    ]
    # Views of the engine's arrays: fetching one costs as much as reading it.
    position, length, passive, bias = data.qpos, data.ten_length, data.qfrc_passive, data.qfrc_bias
    moments, sparse = np.zeros((model.ntendon, model.nv)), sparse_moments(model, data)
    # Which the engine leaves to the actuators of some joints, and does not count as passive there.
    lifting, lifted = data.qfrc_gravcomp, model.jnt_actgravcomp[model.dof_jntid]

    def torques(where: Sequence[float] | FloatArray, pressure: Sequence[float]) -> list[float]:
        position[:] = where
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mju_sparse2dense(moments, *sparse)
        total, arms = (passive - bias + lifted * lifting).tolist(), moments.tolist()
        for (m, tendon), held in zip(muscles, pressure, strict=True):
            at_tendon = float(length[tendon])
            pull = _tension(m, chain_length(m.chain, at_tendon), held)
            pull *= chain_ratio(m.chain, at_tendon)
            if learns(m.learned):
                pull += learned_force(m.learned, at_tendon, 0.0)
            total = [torque - arm * pull for torque, arm in zip(total, arms[tendon], strict=True)]
        return total

    return torques


def _tension(m: Parameters, length: float, pressure: float) -> float:
    """Tension of a muscle behind its chain [N] at a length of its tendon behind the teeth [m]."""
    most = limited(m, static_force(m, length, pressure))
    if m.chain.compliance == 0.0 or not most > 0.0:
        return most

    def miss(pull: float) -> float:
        extension = steady_extension(m.chain, pull)
        return taut(static_force(m, length - extension, pressure)) - pull

    for _ in range(_DOUBLINGS):
        if miss(most) <= 0.0:
            return float(_root(miss, 0.0, most, xtol=_TAUT))
        most *= 2.0  # a muscle that pulls the more, the shorter it is
    return float("nan")


def moment_arms(rig: Rig, positions: FloatArray) -> FloatArray:
    """Change of each tendon's length with each recorded joint's position (..., m, j) [m/rad or 1].

    ``positions``, (..., nq), are where they are taken [rad or m].
    """
    turns = _TURN * np.eye(positions.shape[-1])[rig.position_addresses]
    at = positions[..., np.newaxis, :]
    change = tendon_lengths(rig, at + turns) - tendon_lengths(rig, at - turns)
    return np.swapaxes(change, -1, -2) / (2.0 * _TURN)


def tendon_lengths(rig: Rig, positions: FloatArray) -> FloatArray:
    """(..., m) lengths of the muscles' tendons [m] at positions (..., nq) [rad or m]."""
    model, data = rig.model, mujoco.MjData(rig.model)  # as long to make as a hundred steps
    muscles = [model.actuator_outadr[i] for i in muscle_ids(model)]
    lengths = np.empty((*positions.shape[:-1], len(muscles)))
    for place in np.ndindex(positions.shape[:-1]):
        data.qpos[:] = positions[place]
        measure_tendons(model, data)
        lengths[place] = data.actuator_length[muscles]
    return lengths
