"""Task 3 with scipy.optimize around the plain simulation: the damping of the shaft."""

import sys

import numpy as np
from plain_arm import simulate
from scipy.optimize import least_squares

table = np.genfromtxt(sys.argv[1], delimiter=",", names=True)
start = 1e3 * np.array([table["p1_kpa"][0], table["p2_kpa"][0]])
target = 1e3 * np.array([table["p1_set_kpa"][-1], table["p2_set_kpa"][-1]])
time, angle = table["time_s"], np.radians(table["angle_deg"])


def residual(values):
    run = simulate(start, target, damping=float(np.exp(values[0])), duration=float(time[-1]))
    return np.interp(time, run[:, 0], run[:, 3]) - angle


found = least_squares(residual, np.log([0.5]), diff_step=0.05)
noise = 2 * found.cost / (len(time) - 1)  # as if the noise were white
off = np.sqrt(noise / (found.jac.T @ found.jac)[0, 0])
low, high = np.exp(found.x[0] - 1.96 * off), np.exp(found.x[0] + 1.96 * off)
print(f"damping {np.exp(found.x[0]):.4g} [{low:.4g}, {high:.4g}] N*m*s/rad")
