"""Coverage of the 95 % intervals of a calibration, by noise colour and repeats.

    python scripts/calibration_coverage.py [--runs 400]

The simulator is linear (amplitude, rate and offset of a first-order step at 100 Hz), so that the
estimate has a closed form and only the intervals are tried. Compared are the interval that takes
the noise as white and the one `calibrate` gives.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

import numpy as np
import scipy.signal

from pamsim.core.units import FloatArray
from pamsim.inference.intervals import parameter_covariance
from pamsim.inference.residual_block import BlockPlace, ResidualBlock
from pamsim.inference.simulator_fit import Linearisation

Noise = Callable[[np.random.Generator, int], FloatArray]


def ar1(correlation: float) -> Noise:
    """AR(1) noise of unit variance."""

    def noise(rng: np.random.Generator, count: int) -> FloatArray:
        e = rng.standard_normal(count) * np.sqrt(1.0 - correlation**2)
        e[0] = rng.standard_normal()
        return scipy.signal.lfilter([1.0], [1.0, -correlation], e)

    return noise


def mixed(share: float) -> Noise:
    """White noise plus slow drift (0.3 s) of a share of its size."""
    return lambda rng, count: rng.standard_normal(count) + share * ar1(0.967)(rng, count)


def ringing(rng: np.random.Generator, count: int) -> FloatArray:
    """Noise through a lightly damped resonance at 4.8 Hz."""
    e = rng.standard_normal(count + 300)
    return scipy.signal.lfilter([1.0], [1.0, -1.94 * np.cos(0.3), 0.97**2], e)[300:]


NOISES: dict[str, Noise] = {
    "white": ar1(0.0),
    "AR(1) 0.9": ar1(0.9),
    "AR(1) 0.967": ar1(0.967),
    "white + drift": mixed(1.0),
    "white + 0.3 drift": mixed(0.3),
    "ringing": ringing,
}


def simulator(protocols: str, size: int) -> tuple[tuple[BlockPlace, ...], FloatArray]:
    """Blocks and Jacobian of one trial per letter; trials of a letter are repeats."""
    time = np.arange(size) / 100.0
    fading = np.exp(-3.0 * time)
    heights = dict(zip("abcd", (1.0, -0.6, 1.5, 0.8), strict=True))
    rows = [
        np.column_stack([h * (1.0 - fading), h * time * fading, np.ones(size)])
        for h in (heights[p] for p in protocols)
    ]
    places = tuple(
        BlockPlace(
            ResidualBlock(
                trial=f"t{k}",
                protocol=p,
                channel="angle",
                residual=np.zeros(size),
                sample_interval=0.01,
            ),
            slice(size * k, size * (k + 1)),
        )
        for k, p in enumerate(protocols)
    )
    return places, np.vstack(rows)


def coverage(noise: Noise, protocols: str, size: int, runs: int) -> tuple[float, float]:
    """Smallest coverage over the parameters: white interval, calibration's interval."""
    places, rows = simulator(protocols, size)
    inverse = np.linalg.inv(rows.T @ rows)
    rng = np.random.default_rng(0)
    hits = np.zeros((2, 3))
    for _ in range(runs):
        e = np.concatenate([noise(rng, size) for _ in protocols])
        estimate = -inverse @ rows.T @ e
        residual = e + rows @ estimate
        variance = residual @ residual / (residual.size - 3)
        weight = np.full(e.size, 1.0 / np.sqrt(variance))
        linear = Linearisation(places=places, residual=residual, jacobian=rows, weight=weight)
        found = parameter_covariance(linear, np.eye(3), np.zeros((3, 3)))
        halves = (
            1.96 * np.sqrt(variance * np.diag(inverse)),
            found.quantile * np.sqrt(np.diag(found.matrix)),
        )
        hits += [np.abs(estimate) <= half for half in halves]
    least = hits.min(axis=1) / runs
    return float(least[0]), float(least[1])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=400)
    runs = parser.parse_args().runs
    shapes = [("ab", 400), ("abcd", 400), ("abcd", 800), ("aaaabbbb", 400)]
    print(
        f"{'smallest coverage [%]: white -> given':40s}",
        *(f"{p} x {n / 100:g} s" for p, n in shapes),
    )
    for name, noise in NOISES.items():
        cells = [coverage(noise, p, n, runs) for p, n in shapes]
        print(f"{name:40s}", *(f"{100 * w:.0f} -> {100 * g:.0f}" for w, g in cells), sep="   ")


if __name__ == "__main__":
    main()
