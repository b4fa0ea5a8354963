"""Hysteresis of a muscle: its own operator, and Maxwell slip in parallel.

``m`` are the parameters of one actuator and ``z`` its memory of hysteresis, see
`pamsim.physics.record`: the operator's own states, then the blocks of the one in parallel.
"""

from __future__ import annotations

from pamsim.physics.chosen_law import operator_energy, operator_output, operator_rates
from pamsim.physics.hysteresis.maxwell_slip import (
    BLOCKS,
    bent_slip_output_and_energy,
    slip_output_and_energy,
    slip_rates,
)
from pamsim.physics.record import MutableRow, Parameters, Row


def hysteresis_force(
    m: Parameters, z: Row, contraction: float, pressure: float, static_force: float
) -> float:
    """Force that hysteresis takes from the static force [N]; 0 without width.

    The pressure is gauge and not below 0 [Pa], the static force signed [N].
    """
    taken = 0.0
    if _has_own(m):
        width = m.hysteresis.force + m.hysteresis.force_per_pressure * pressure
        width += m.hysteresis.force_share * static_force
        taken = width * (operator_output(m, z, contraction) - m.hysteresis.chord * contraction)
    if _has_parallel(m):
        width = m.parallel_hysteresis.force + m.parallel_hysteresis.force_per_pressure * pressure
        output = _parallel_output_and_energy(m, z, contraction)[0]
        taken += width * (output - m.parallel_hysteresis.chord * contraction)
    return taken


def hysteresis_volume(m: Parameters, z: Row, contraction: float) -> float:
    """Volume that the energy in the hysteresis takes [m^3]: minus its derivative by pressure.

    Without it a loop that is wider at a higher pressure could be loaded at a low one and unloaded
    at a high one, and give energy in every cycle. See `pamsim.physics.hysteresis.group`.
    """
    volume, square, nominal = 0.0, contraction * contraction, m.braid.nominal_length
    per_pressure = m.hysteresis.force_per_pressure
    if m.hysteresis.law != 0.0 and per_pressure != 0.0:
        held = operator_energy(m, z, contraction) - 0.5 * m.hysteresis.chord * square
        volume = -per_pressure * nominal * held
    per_pressure = m.parallel_hysteresis.force_per_pressure
    if per_pressure != 0.0:
        held = _parallel_output_and_energy(m, z, contraction)[1]
        held -= 0.5 * m.parallel_hysteresis.chord * square
        volume -= per_pressure * nominal * held
    return volume


def hysteresis_rates(
    m: Parameters, z: Row, dz: MutableRow, contraction: float, rate: float, timestep: float
) -> None:
    """Write the rates of the memory [1/s] in an Euler step [s]; without width it is not kept up."""
    at = len(z) - BLOCKS
    for i in range(len(z)):
        dz[i] = 0.0
    if _has_own(m):
        operator_rates(m, z, dz, contraction, rate, timestep)
    if _has_parallel(m):
        slip_rates(BLOCKS, m.parallel_hysteresis.full_slip, z, dz, at, contraction, timestep)


def _parallel_output_and_energy(m: Parameters, z: Row, contraction: float) -> tuple[float, float]:
    slip, decay = m.parallel_hysteresis.full_slip, m.parallel_hysteresis.decay
    side, dead = m.parallel_hysteresis.asymmetry, m.parallel_hysteresis.dead_zone
    if side != 0.0 or dead > 0.0:
        at = len(z) - BLOCKS
        return bent_slip_output_and_energy(BLOCKS, slip, decay, side, dead, z, at, contraction)
    return slip_output_and_energy(BLOCKS, slip, decay, z, len(z) - BLOCKS, contraction)


def _has_own(m: Parameters) -> bool:
    return m.hysteresis.force + m.hysteresis.force_per_pressure + m.hysteresis.force_share > 0.0


def _has_parallel(m: Parameters) -> bool:
    return m.parallel_hysteresis.force + m.parallel_hysteresis.force_per_pressure > 0.0
