# %% [markdown]
# # Hide an effect, and find it
#
# Before a diagnosis is trusted with measurements, it should find what is known. Here dry friction
# is hidden in synthetic recordings of the arm; the diagnosis gets the recordings and the arm
# without friction.
#
# Download: {nb-download}`hide_and_diagnose.ipynb`

# %%
import matplotlib.pyplot as plt
import numpy as np

import pamsim

INPUTS = ("triangle", "loaded_steps")  # in a test: ("triangle",)
DURATION = 2.0  # in a test: 0.5
REPEATS = 5
TRIED = ["coulomb_friction", "stribeck_friction", "viscous_friction"]  # in a test: ["angle_bias"]

hidden = pamsim.hide(
    "mas20_arm",
    {"coulomb_friction": 1.0},  # in typical sizes
    protocols=INPUTS,
    repeats=REPEATS,
    duration=DURATION,  # s
)
hidden.save("recording")
print(hidden.summary())
print(hidden.hidden)  # in SI; kept apart from the recording

# %% [markdown]
# What the recording shows, beside the arm without friction under the same commands:

# %%
trial = pamsim.read_recordings("recording").trials[0]
again = pamsim.simulate("mas20_arm", pamsim.experiment_of(trial))
simulated = pamsim.at_times(again, trial)
plt.figure(figsize=(7, 3))
plt.plot(trial.time, np.degrees(trial.measured["angle"]), color="black", label="recorded")
plt.plot(trial.time, np.degrees(simulated["angle"]), color="#0072b2", label="simulated")
plt.xlabel("time [s]")
plt.ylabel("angle [deg]")
_ = plt.legend()

# %% [markdown]
# `check` takes seconds, and reports from which size on these data would show an effect:

# %%
checked = pamsim.check("recording")
print(checked.summary())

# %% [markdown]
# `diagnose` simulates each link of the chain with its measured inputs, adds effects as long as they
# explain what is left there, and judges by trials that no fit has seen. Without `effects` all are
# tried, in some minutes.

# %%
found = pamsim.diagnose("recording", effects=TRIED)
print(found.verdict)
print(found.summary())

# %%
pamsim.plot(found)

# %% [markdown]
# The name is as deep as it holds, and comes with its size in physical terms; 0.3 N·m was hidden. A
# size without an interval is a condition of the test. Where something is open, the result states
# what to record next:
# [how to read it](../diagnose.md#how-to-read-the-result).

# %%
for effect in found.effects:
    print(f"{effect.certain_words}: certain to its {effect.level}")
    for name, size in effect.physical.items():
        print(f"{name}: {size.value:.4g} {size.unit}, 95 % interval {size.interval95}")
found.save("diagnosed")  # the result, and the rig with what was found in diagnosed/rig
