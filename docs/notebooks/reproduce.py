# %% [markdown]
# # Reproduce a paper's experiments
#
# Matiskova 2021 prints where an arm with two MAS-20 muscles came to rest: 24 rows of pressures,
# load and angle, 21 of them distinct. Here each row is an experiment with the simulated arm
# `mas20_arm`, and its last angle is compared with the printed one.
#
# Download: {nb-download}`reproduce.ipynb`

# %%
import matplotlib.pyplot as plt
import numpy as np

import pamsim
from pamsim.identification.step_response import identify_step
from pamsim.papers.printed_steps import find_start, printed_experiment
from pamsim.recordings.printed import mas20_steps

ROWS = 24  # in a test: 2

rig = pamsim.load_rig("mas20_arm")
rows = [row for row in mas20_steps()[:ROWS] if row.repeats is None]
print(len(rows), "distinct rows, the first:", rows[0])

# %% [markdown]
# The paper does not print where a step began. Its text gives the concept: both muscles are filled
# equally, then one is vented. That is the assumption `vent`; `find_start` has others.

# %%
start = find_start("vent")
print(start.meaning)
runs = pamsim.simulate_batch([(rig, printed_experiment(row, start)) for row in rows])
simulated = np.degrees([run.completed().angle[-1] for run in runs])
printed = np.degrees([row.angle for row in rows])
print(f"{np.sqrt(np.mean((simulated - printed) ** 2)):.2f} deg RMS")

# %%
figure, axes = plt.subplots(figsize=(7, 4))
difference = [(row.pressure[0] - row.pressure[1]) / 1e3 for row in rows]
axes.plot(difference, printed, "o", color="black", label="printed")
axes.plot(difference, simulated, "x", color="#d55e00", label="simulated")
axes.set(xlabel="difference of the pressures [kPa]", ylabel="angle at rest [deg]")
_ = axes.legend()

# %% [markdown]
# The rig was calibrated to these rows, so that this number alone proves little. What it is worth
# at rows that no fit has seen stands in the README of [the rig](../../models/mas20_arm/README.md).
#
# From the first large step the paper identified two transfer functions, $G_1 = K / (T s + 1)$ and
# $G_2$ with two time constants. The same from the simulated step, by output error:

# %%
large = runs[0]
identified = identify_step(large.time, large.angle)
(t,) = identified.g1.output_error.time_constants
t1, t2 = identified.g2.output_error.time_constants
print(f"G1: T = {t:.3f} s (printed 0.646 s)")
print(f"G2: T1 = {t1:.3f} s, T2 = {t2:.3f} s (printed 0.090 s, 0.579 s)")
pamsim.plot(large)

# %% [markdown]
# `pamsim reproduce` does all of this, with checks and a page. `pamsim.replicate` recomputes every
# printed number of all five papers and judges it; here those of the shortest one:

# %%
sarosi = pamsim.replicate(["sarosi"])
print(sarosi.summary())
for claim in sarosi.claims[:5]:
    print(f"{claim.verdict}: {claim.statement}")
