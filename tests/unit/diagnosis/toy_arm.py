"""A small arm in closed form, quick enough to diagnose hundreds of times."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from pamsim.comparison.candidate import Candidate, Probe
from pamsim.comparison.trial_residuals import TrialSimulator
from pamsim.effects.effect import Effect, EffectParameter
from pamsim.inference.free_parameter import FreeParameter
from pamsim.inference.residual_block import ResidualBlock

RATE, COUNT = 50.0, 200
TIME = np.arange(COUNT) / RATE
NOISE = {"angle": 0.02, "pressure_1": 0.05}
PROTOCOLS = ("slow", "fast", "high")
OWN = {"gain": 1.0, "lag": 0.4, "dry": 0.0, "bias": 0.0, "twin": 0.0, "leak": 0.0, "ripple": 0.0}
OWN["wide"] = 0.0  # friction that needs more speed to be whole


def drive(protocol, check):
    """What is commanded: check trials run at another rate and level."""
    pace = {"slow": 0.5, "fast": 1.5, "high": 0.8}[protocol] * (1.3 if check else 1.0)
    level = 2.0 if protocol == "high" else 1.0
    return level * (1.0 + 0.8 * np.sin(2 * np.pi * pace * TIME))


def signals(values, u):
    """Angle and pressure of the arm."""
    pressure = u * (1.0 - values["leak"])
    keep = np.exp(-1.0 / (RATE * values["lag"]))
    angle = values["gain"] * lfilter([1.0 - keep], [1.0, -keep], pressure)
    speed = np.gradient(angle, TIME)
    angle = angle - values["dry"] * np.tanh(speed / 0.2) + values["bias"]
    angle = angle + values["twin"] * np.tanh(speed / 0.21)
    angle = angle - values["wide"] * np.tanh(speed / 0.35)
    angle = angle + values["ripple"] * np.sin(25.0 * angle)
    return {"angle": angle, "pressure_1": pressure}


def noise(rng, drift):
    keep = np.exp(-1.0 / (RATE * 0.3)) if drift else 0.0
    white = rng.standard_normal(COUNT + 200)
    return np.sqrt(1.0 - keep**2) * lfilter([1.0], [1.0, -keep], white)[200:]


def recorded(hidden, *, seed=0, repeats=4, drift=False, variation=0.002):
    """Trials of the arm with hidden effects: (name, protocol, check, measured)."""
    rng = np.random.default_rng([seed, 5])
    trials = []
    for protocol in PROTOCOLS:
        for check in (False, True):
            for repeat in range(repeats):
                varied = {**OWN, **hidden}
                varied["gain"] *= 1.0 + variation * rng.standard_normal()
                clean = signals(varied, drive(protocol, check))
                measured = {c: y + NOISE[c] * noise(rng, drift) for c, y in clean.items()}
                end = "_check" if check else ""
                trials.append((f"{protocol}{end}_{repeat}", f"{protocol}{end}", check, measured))
    return trials


def simulator(trials, base=OWN):
    """The arm without effects, against trials."""

    def simulate(sets, *, held_out, fine):
        answers = []
        for values in sets:
            blocks = []
            for name, protocol, check, measured in trials:
                if check and not held_out:
                    continue
                found = signals({**base, **values}, drive(protocol.split("_")[0], check))
                blocks += [
                    ResidualBlock(
                        trial=name,
                        protocol=protocol,
                        channel=channel,
                        residual=found[channel] - measured[channel],
                        sample_interval=1.0 / RATE,
                    )
                    for channel in measured
                ]
            answers.append(blocks)
        return answers

    return TrialSimulator(
        simulate=simulate, held_out=frozenset(name for name, _, check, _ in trials if check)
    )


def regressors(trials):
    """Quantities over which residuals are mapped, as the arm with some values has them."""

    def quantities(values):
        return {
            name: {
                "elapsed": TIME,
                "pressure": signals({**OWN, **values}, drive(protocol.split("_")[0], check))[
                    "pressure_1"
                ],
            }
            for name, protocol, check, _ in trials
        }

    return quantities


NUISANCE = (FreeParameter(name="gain", unit="1", start=1.0, low=0.3, high=3.0),)


def candidate(name, low, high, typical, family=None, *, form_of=""):
    """An effect of the toy; of several forms that share a name, each has a parameter of its own."""
    effect = Effect(
        name=form_of or name, form=name if form_of else "", family=family or name, missing=name,
        parameters=(EffectParameter(name=name, typical=typical, low=low, high=high),),
        look_alikes=(), separating="",
    )  # fmt: skip
    probes = [Probe(size=size, values={name: size * typical}) for size in (0.3, 1.0, 3.0)]
    return Candidate(
        effect=effect,
        parameters=(FreeParameter(name=name, unit="1", start=typical, low=low, high=high),),
        neutral={name: 0.0},
        probes=tuple(probes),
        usual=form_of in ("", name),
    )


DRY = candidate("dry", 0.0, 1.0, 0.03)
TWIN = candidate("twin", -1.0, 0.0, -0.03, family="dry")
WIDE = candidate("wide", 0.0, 1.0, 0.03, family="dry")
BIAS = candidate("bias", -1.0, 1.0, 0.02)
LEAK = candidate("leak", 0.0, 0.5, 0.03)
