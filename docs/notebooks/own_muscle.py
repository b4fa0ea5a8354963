# %% [markdown]
# # Your own muscle from a force map
#
# A force map is a table of pressure, contraction and force, as a tensile machine gives it. Here it
# is the published one of a Festo DMSP-20-300N (Martens and Boblan 2017), written as your own CSV
# would be: the unit is in the name of each column.
#
# Download: {nb-download}`own_muscle.ipynb`

# %%
import csv
import re
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import pamsim

COMPARED = True  # in a test: False

package = Path(pamsim.__file__).parent
lines = (package / "data" / "dmsp20_300_force_map.csv").read_text().splitlines()
rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
with open("my_muscle.csv", "w", newline="") as file:
    writer = csv.writer(file)
    writer.writerow(["p_kpa", "contraction", "force_n"])
    for row in rows:
        writer.writerow([float(row["p_gauge_Pa"]) / 1e3, row["contraction_ratio"], row["force_N"]])
print(len(rows), "points")

# %% [markdown]
# ## Which law?
#
# `compare=True` fits every law that suits the table and ranks them by the error at lengths that
# were held out, not by the error of the fit. Zeros mean slack or not measured and are left out.

# %%
braid = {"nominal_length": 0.3, "diameter": 0.02, "fibre_angle": np.radians(28.6)}
if COMPARED:
    ranked = pamsim.fit("my_muscle.csv", compare=True, **braid)
    print(ranked.summary())

# %%
result = pamsim.fit("my_muscle.csv", model="mooney_rivlin", **braid)
print(result.summary())
for coefficient in result.fits[0].fit.coefficients:
    print(coefficient.name, coefficient.value, coefficient.interval95, coefficient.flags)

# %%
pamsim.plot(result)

# %% [markdown]
# ## Into a rig
#
# `save` writes the sections of `params.toml` that the law needs. A bench with one muscle takes
# them in place of its own.

# %%
result.save("fitted")
section = Path("fitted/params.toml").read_text()
print(section)

# %%
folder = pamsim.new_rig("my_bench", kind="bench")
params = folder / "params.toml"
text = params.read_text()
for header in re.findall(r"^\[muscle\.\w+\]", section, re.MULTILINE):
    text = re.sub(rf"^{re.escape(header)}\n(.+\n)+", "", text, flags=re.MULTILINE)
params.write_text(text + "\n" + section)

rig = pamsim.load_rig(folder)
(muscle,) = rig.muscles.values()
print(muscle.force)

# %% [markdown]
# The bench lifts 10 kg while the pressure rises from 1 to 4 bar:

# %%
lift = pamsim.pressure_step((1e5,), (4e5,), duration=2.0, load=10.0)
run = pamsim.simulate(rig, lift).completed()
print(run.summary())

# %%
plt.figure(figsize=(7, 3))
plt.plot(run.time, 1e3 * run.positions[:, 0])
plt.xlabel("time [s]")
_ = plt.ylabel("position of the weight [mm]")

# %% [markdown]
# Valves, damping and mounting of that bench are still assumed. They come from a recording:
# [calibrate](../calibrate.md).
