"""Task 4 by hand: fit three candidate effects, compare them on held-out trials, plot residuals."""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from plain_arm import simulate
from scipy.optimize import minimize_scalar

CANDIDATES = {"damping": (0.1, 3.0), "friction": (0.0, 1.0), "leak": (0.0, 2e-11)}


def read(path):
    table = np.genfromtxt(path, delimiter=",", names=True)
    start = 1e3 * np.array([table["p1_kpa"][0], table["p2_kpa"][0]])
    set_points = 1e3 * np.column_stack([table["p1_set_kpa"], table["p2_set_kpa"]])
    return table["time_s"], np.radians(table["angle_deg"]), start, (table["time_s"], set_points)


def residual(trial, **effect):
    time, angle, start, target = trial
    run = simulate(start, target, load=0.0, duration=float(time[-1]), **effect)
    return np.degrees(np.interp(time, run[:, 0], run[:, 3]) - angle)


def rms(trials, **effect):
    return np.sqrt(np.mean(np.concatenate([residual(trial, **effect) for trial in trials]) ** 2))


fitted, held_out = map(read, sys.argv[1:3])
print(f"nothing added: held-out RMS {rms([held_out]):.2f} deg")
figure, axes = plt.subplots(len(CANDIDATES), sharex=True)
for ax, (name, bounds) in zip(axes, CANDIDATES.items(), strict=True):
    found = minimize_scalar(
        lambda x, n=name: rms([fitted], **{n: x}), bounds=bounds, options={"maxiter": 8}
    )
    left = residual(held_out, **{name: found.x})
    print(f"{name} {found.x:.3g}: held-out RMS {np.sqrt(np.mean(left**2)):.2f} deg")
    ax.plot(held_out[0], left)
    ax.set_title(name)
figure.savefig("residuals.png")
