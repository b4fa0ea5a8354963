"""Task 2 with scipy and python-control: a second-order transfer function from a step."""

import sys

import control
import numpy as np
from scipy.optimize import least_squares

table = np.genfromtxt(sys.argv[1], delimiter=",", names=True)
time = table["time_s"]
step = table["p1_set_kpa"] - table["p2_set_kpa"]
angle = table["angle_deg"]
step, angle = step - (table["p1_kpa"] - table["p2_kpa"])[0], angle - angle[0]


def model(values):
    gain, first, second = np.exp(values)
    return control.tf([gain], [first * second, first + second, 1.0])


def residual(values):
    return control.forced_response(model(values), time, step).outputs - angle


best = min(
    (
        least_squares(residual, np.log([0.05, fast, slow]))
        for fast in (0.03, 0.1)
        for slow in (0.3, 1.0)
    ),
    key=lambda found: found.cost,
)
noise = 2 * best.cost / (len(time) - 3)  # as if the noise were white
deviation = np.sqrt(noise * np.diag(np.linalg.inv(best.jac.T @ best.jac)))
for name, value, off in zip(("gain", "T1", "T2"), best.x, deviation, strict=True):
    low, high = np.exp(value - 1.96 * off), np.exp(value + 1.96 * off)
    print(f"{name} {np.exp(value):.4g} [{low:.4g}, {high:.4g}]")
print(f"fit {100 * (1 - np.linalg.norm(best.fun) / np.linalg.norm(angle - angle.mean())):.1f} %")
