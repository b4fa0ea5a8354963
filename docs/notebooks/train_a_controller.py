# %% [markdown]
# # Train a controller
#
# The arm with 1.2 kg is to follow sines. A controller with five numbers is trained by the
# cross-entropy method: draw candidates, keep the best, draw again around them. It needs numpy
# only. For neural policies by PPO there is `pamsim train` ([control](../control.md)).
#
# Download: {nb-download}`train_a_controller.ipynb`

# %%
import gymnasium
import matplotlib.pyplot as plt
import numpy as np

import pamsim
import pamsim.envs
from pamsim.controllers import JointControl, NeuralPolicy, PolicyFile
from pamsim.envs import run_episode, score

GENERATIONS = 30  # in a test: 1
UNSEEN = 5  # in a test: 1
CANDIDATES, KEPT, STEPS = 16, 5, 100

arms = gymnasium.make_vec(
    "pamsim/PamArmPressure-v0",
    num_envs=CANDIDATES,
    vectorization_mode="vector_entry_point",
    task="sine",
    load=1.2,
)
signals = arms.unwrapped.rigs.signals
print(*signals.names, sep=", ")

# %% [markdown]
# An observation holds the signals above, each scaled to the order of 1; an action holds the set
# points of both muscles, from -1 (0 kPa) to 1 (the supply's pressure). The controller has a common
# level and turns the arm by a difference: from the error, the reference, the velocity, and the
# reference's rate.


# %%
def layer(numbers):
    """Weights (2, 8) and biases (2,) of the controller."""
    level, error, reference, velocity, rate = numbers
    turn = np.array([-error, -velocity, 0.0, 0.0, error + reference, rate, 0.0, 0.0])
    return np.stack([turn, -turn]), np.array([level, level])


def rewards(candidates, seed):
    """Reward of an episode of each candidate; all follow the same reference."""
    weights, biases = map(np.array, zip(*map(layer, candidates), strict=True))
    observation, _ = arms.reset(seed=[seed] * CANDIDATES)
    total = np.zeros(CANDIDATES)
    for _ in range(STEPS):
        action = np.einsum("nij,nj->ni", weights, observation) + biases
        observation, reward, *_ = arms.step(np.clip(action, -1.0, 1.0).astype(np.float32))
        total += reward
    return total


# %% [markdown]
# Every generation has another reference, the same for all candidates, so that no candidate gains
# by an easier one.

# %%
rng = np.random.default_rng(0)
mean, spread = np.zeros(5), np.array([0.3, 1.0, 1.0, 0.5, 0.5])
curve = []
for generation in range(GENERATIONS):
    drawn = mean + spread * rng.standard_normal((CANDIDATES, 5))
    reached = rewards(drawn, seed=generation)
    best = drawn[np.argsort(reached)[-KEPT:]]
    mean, spread = best.mean(axis=0), best.std(axis=0) + 0.02
    curve.append(np.median(reached))
arms.close()

figure, axes = plt.subplots(figsize=(7, 3))
axes.plot(curve)
_ = axes.set(xlabel="generation", ylabel="median reward")

# %% [markdown]
# The result is a policy with a single layer, which drives the arm wherever a controller does. It
# is judged on references that the training has not seen, beside a controller that was designed
# from the rig's own force law:

# %%
rig = pamsim.load_rig("mas20_arm")
weight, bias = layer(mean)
policy = PolicyFile(
    joints=tuple(rig.joints),
    muscles=tuple(rig.muscles),
    command="pressure_set",
    supply=rig.supply_pressure,
    centre=signals.centre,
    scale=signals.scale,
    weights=(weight,),
    biases=(bias,),
)
controllers = {
    "trained": NeuralPolicy(policy=policy),
    "designed": JointControl.for_rig(rig, closed_loop_time=0.1, load=1.2),
}
env = gymnasium.make("pamsim/PamArmPressure-v0", task="sine", load=1.2, max_episode_steps=2 * STEPS)
for name, controller in controllers.items():
    runs = [run_episode(env, controller, seed=seed) for seed in range(1000, 1000 + UNSEEN)]
    errors = [score(run).rmse for run in runs]
    print(f"{name}: {np.degrees(np.mean(errors)):.1f} deg RMS, mean of {UNSEEN} unseen references")
env.close()
