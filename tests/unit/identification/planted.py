"""Planted linear systems, simulated by scipy and not by what is tested."""

import functools

import numpy as np
import pytest
from scipy.signal import cont2discrete, fftconvolve, lfilter, tf2ss

from pamsim.core.errors import InputError
from pamsim.identification.continuous import ContinuousStructure
from pamsim.identification.discrete import DiscreteStructure
from pamsim.identification.fit import fit
from pamsim.identification.identify import identify
from pamsim.identification.records import SignalRecord
from pamsim.identification.structure_scan import scan_structures
from pamsim.recordings.trial import Trial, TrialSet


def sampled(numerator, denominator, given, interval, delay=0.0, fine=None):
    """Run a continuous system under a held input; a delay is whole steps of ``interval/fine``."""
    fine = fine or (20 if delay else 1)
    step = interval / fine
    held = np.concatenate([np.zeros(round(delay / step)), np.repeat(given, fine)])
    # In state space: a transfer function in z loses digits where sampling is fast.
    a, b, c, _, _ = cont2discrete(tf2ss(numerator, denominator), step, method="zoh")
    x, y = np.zeros(a.shape[0]), []
    for u in held[: given.size * fine]:
        y.append(c[0] @ x)
        x = a @ x + b[:, 0] * u
    return np.array(y[::fine])


# What a test of something else is fitted with.
FEW = {"order": 1, "dead_time": "none", "arx": (1, 1, 1), "oe": (1, 1, 1), "local": False}


def log(path, header, *columns):
    """A table as a data logger writes it."""
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="")
    return path


def best_of(records, start="free"):
    """The best structure of a scan by its criterion."""
    return min(scan_structures(records, start=start), key=lambda fit: fit.criterion)


def lags(*constants):
    result = np.array([1.0])
    for constant in constants:
        result = np.convolve(result, [constant, 1.0])
    return result


def steps(rng, n, hold, rest=20):
    """Levels -1, 0 or 1 held for ``hold`` samples, after a rest at 0."""
    levels = rng.choice([-1.0, 0.0, 1.0], n // hold + 1)
    return np.concatenate([np.zeros(rest), np.repeat(levels, hold)])[:n]


def coloured(rng, n, phi):
    """Noise of unit variance, AR(1) with coefficient phi."""
    white = rng.standard_normal(n + 500)
    return np.sqrt(1.0 - phi**2) * lfilter([1.0], [1.0, -phi], white)[500:]


def fractional(rng, n, d):
    """Noise whose spectrum grows as f^-2d: its moving average, over 20,000 samples before it."""
    lags = np.arange(1, n + 20_000)
    weights = np.append(1.0, np.cumprod((lags - 1.0 + d) / lags))
    return fftconvolve(rng.standard_normal(weights.size + n), weights)[weights.size :][:n]


def cut_out(
    above, below, seed, *, n=400, noise=0.03, slow=0.0, delay=0.0, bend=0.0, drift=0.0, bias=0.0
):
    """A trial cut out of motion, 20 samples a second: what came before it is not in the record."""
    draw, interval = np.random.default_rng(seed), 0.05
    given = steps(draw, n + 100, 10)
    output = sampled(above, below, given - bias, interval, delay)
    output = output + bend * output**2
    white = draw.normal(size=output.size)
    error = noise * np.std(output) * (coloured(draw, output.size, slow) if slow else white)
    output = 0.7 + output + error + drift * np.arange(-100, n) / (n - 1)
    time = interval * np.arange(n)
    return SignalRecord(f"trial {seed}", time, given[100:], output[100:], ("V",), "m")


def record(
    seed,
    *,
    constants=(0.3,),
    gain=2.0,
    delay=0.0,
    noise=0.0,
    phi=0.0,
    memory=None,
    n=600,
    interval=0.02,
    offset=0.7,
    hold=25,
    numerator=None,
    denominator=None,
):
    rng = np.random.default_rng(seed)
    u = steps(rng, n, hold)
    above = [gain] if numerator is None else numerator
    below = lags(*constants) if denominator is None else denominator
    y = sampled(above, below, u, interval, delay)
    errors = coloured(rng, n, phi) if memory is None else fractional(rng, n, memory)
    y = offset + y + noise * errors
    return SignalRecord(f"trial {seed}", interval * np.arange(n), u, y, ("Pa",), "rad")


def arx(a, b, interval, delay=1):
    """An ARX model of these coefficients, without a fit."""
    return DiscreteStructure("arx", len(a), len(b), delay, interval), np.array([*a, *b])


def fit_continuous(records, *, zeros=0, starts=(), held_out=(), **which):
    """A continuous fit; zeros of each input, or one number for all."""
    each = () if isinstance(zeros, int) else zeros
    most = zeros if isinstance(zeros, int) else max(zeros)
    inputs = records[0].inputs.shape[1]
    structure = ContinuousStructure(zeros=most, zeros_each=each, inputs=inputs, **which)
    return fit(records, structure, starts=starts, held_out=held_out)


def fit_arx(records, *, na, nb, nk, **more):
    return fit(records, DiscreteStructure("arx", na, nb, nk, records[0].sample_time), **more)


def fit_oe(records, *, nb, nf, nk):
    return fit(records, DiscreteStructure("oe", nf, nb, nk, records[0].sample_time))


def first_order_step(time, constant, gain=1.0):
    return -gain * np.expm1(-np.maximum(time, 0.0) / constant)


def second_order_step(time, first, second, gain=1.0):
    """The textbook's form without its division by T1 - T2, before 0 nothing."""
    small, large = sorted((first, second))
    scaled = np.maximum(time, 0.0) / large
    x = scaled * ((large - small) / small)
    safe = np.where(x > 0.0, x, 1.0)
    phi = np.where(x > 0.0, -np.expm1(-safe) / safe, 1.0)
    return gain * (-np.expm1(-scaled) - np.exp(-scaled) * scaled * phi)


def refuses(match, call, *args, **options):
    """A call that is refused with a sentence."""
    with pytest.raises(InputError, match=match):
        call(*args, **options)


TS, GAIN, LAG = 0.02, 1e-6, 0.4
FEW = {"order": 1, "dead_time": "none", "arx": (1, 1, 1), "oe": (1, 1, 1), "local": False}


def trial(name, seed):
    """A lag from the pressure difference to the angle."""
    given = record(seed, constants=(LAG,), gain=GAIN * 1e5, noise=5e-4, n=400, offset=0.0)
    half = 0.5e5 * given.input
    command = np.column_stack([3e5 + half, 3e5 - half])
    return Trial(
        name=name,
        protocol="telegraph",
        drive="pressure_set",
        load=0.0,
        time=given.time,
        command=command,
        measured={
            "angle": given.output,
            "pressure_1": command[:, 0],
            "pressure_2": command[:, 1],
        },
    )


@functools.cache
def identified_lag():
    """A lag identified from one recording, with another held out."""
    data = TrialSet(rig="mas20_arm", trials=(trial("telegraph_1", 1), trial("telegraph_2", 2)))
    signals = {"input": "p1_set_kpa-p2_set_kpa", "output": "angle_deg"}
    return identify(data, **signals, **FEW, hold_out=["telegraph_2"])
