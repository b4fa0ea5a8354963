"""What makes trials of one rig differ."""

import numpy as np

import pamsim
from pamsim.physics.record import pack
from pamsim.twins.noise import with_variation


def test_what_varies_from_trial_to_trial_is_what_a_muscle_or_bellows_has():
    for name, own in (("mas20_arm", 4), ("equimus_leg", 3)):  # bellows have no tube
        rig = pamsim.load_rig(name)
        varied = with_variation(rig, np.random.default_rng(1), 0.01).muscles
        changed = {
            slot
            for muscle, before in rig.muscles.items()
            for slot, number in enumerate(pack(before))
            if number != pack(varied[muscle])[slot]
        }
        assert len(changed) == own
