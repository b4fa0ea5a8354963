"""How often the intervals of `pamsim fit` hold where points of a map share an error.

    python scripts/fit_coverage.py [--maps 200] [--json scripts/results/fit_coverage.json]

Each map is drawn from the six-parameter law of a DMSP-20-200 (Sarosi), on a grid of pressures and
contractions, with 5 N of noise; in some settings every pressure sweep, or every length, has an
error of its own besides. Counted are 95 % intervals of all coefficients that hold the planted one,
and, beside them, those of least squares that takes every point as independent. A minute.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import tqdm
from records import head, parser, print_and_write, share

from pamsim.fitting.curve_fit import CurveFit, fit_curve
from pamsim.fitting.force_map import fit_force_law, law_coefficients, law_curve, named_law
from pamsim.physics.braid import Braid
from pamsim.recordings.measured_table import ForceMap

MODEL = "six_parameter"
PLANTED = {"a": -4e-5, "b": 292.5, "c": -32.93, "d": -9.336e-3, "e": 2.941e-3, "f": -280.5}
"""Coefficients with forces in N, pressures in Pa; those of docs/fit.md."""

BRAID = Braid(nominal_length=0.2, diameter=0.02, fibre_angle=0.44)  # the law takes none of it
NOISE = 5.0  # [N]
GRIDS = {"5 pressures, 12 lengths": (5, 12), "8 pressures, 6 lengths": (8, 6)}
SHARED = {
    "none": (0.0, 0.0),
    "of a sweep, as large as the noise": (1.0, 0.0),
    "of a sweep, 3 times as large": (3.0, 0.0),
    "of a length, as large as the noise": (0.0, 1.0),
    "of a length, 3 times as large": (0.0, 3.0),
}
"""Error that points share -> its size for a pressure and for a length [noise]."""


def drawn(grid: tuple[int, int], shared: tuple[float, float], rng: np.random.Generator) -> ForceMap:
    """A map with its errors."""
    places = np.linspace(100e3, 500e3, grid[0]), np.linspace(0.0, 0.2, grid[1])
    pressure, contraction = (axis.ravel() for axis in np.meshgrid(*places, indexing="ij"))
    table = ForceMap(
        pressure=pressure,
        contraction=contraction,
        force=np.zeros(pressure.size),
        nominal_length=BRAID.nominal_length,
    )
    curve = law_curve(named_law(MODEL), table, BRAID, np.arange(pressure.size))
    names = [c.name for c in law_coefficients(named_law(MODEL), BRAID, {})]
    errors = rng.normal(size=grid)
    errors += shared[0] * rng.normal(size=(grid[0], 1)) + shared[1] * rng.normal(size=(1, grid[1]))
    planted = np.array([PLANTED.get(name, 1.0) for name in names])
    return replace(table, force=curve(planted) + NOISE * errors.ravel())


def hits(fit: CurveFit) -> list[bool]:
    """Whether each interval holds what was planted."""
    return [
        low <= PLANTED[one.name] <= high
        for one in fit.coefficients
        if one.interval95 is not None and one.name in PLANTED
        for low, high in [one.interval95]
    ]


def main() -> None:
    """Draw, fit and count."""
    options = parser(__doc__, maps=200).parse_args()
    rows: list[dict[str, Any]] = []
    settings = [(grid, error) for grid in GRIDS for error in SHARED]
    for number, (grid, error) in enumerate(tqdm.tqdm(settings, desc="settings")):
        found: list[bool] = []
        alone: list[bool] = []
        for seed in range(options.maps):
            table = drawn(GRIDS[grid], SHARED[error], np.random.default_rng([number, seed]))
            fitted = fit_force_law(table, MODEL, BRAID, held={}, hold_out="none")
            found += hits(fitted.fit)
            curve = law_curve(named_law(MODEL), table, BRAID, np.arange(table.force.size))
            coefficients = law_coefficients(named_law(MODEL), BRAID, {})
            alone += hits(fit_curve(curve, table.force, coefficients))
        rows.append(
            {
                "map": grid,
                "shared error": error,
                "fit": share(sum(found), len(found)),
                "independent": share(sum(alone), len(alone)),
            }
        )
    record = {**head(f"python scripts/fit_coverage.py --maps {options.maps}"), "rows": rows}
    print_and_write(record, options.json)


if __name__ == "__main__":
    main()
