"""The page on real data quotes the record of the soft arm."""

import pytest

from tests.records import recorded, words

SMALL = "first_order_dead_time"


@pytest.fixture(scope="module")
def arm():
    return recorded("results/soft_arm")


def pair(model, digits):
    """RMS with the constant of January 10, and with one free for every trial."""
    if model is None:
        return "-"
    return ", ".join(
        f"{model[key]:.{digits}f}" if key in model else "-" for key in ("rms", "rms_constant_free")
    )


def test_the_arm_s_table_is_the_record(arm):
    for name, link in arm["links"].items():
        if name.endswith(", 10-2"):
            continue
        shown = name.removesuffix(", all")
        rig = arm["rigs"].get(shown.removeprefix("regulator "))
        digits = 2 if rig else 1
        unit = "psi" if rig else "mm"
        models = (link["models"][link["chosen"]], link["models"][SMALL], rig)
        row = [shown, f"{link['stroke']:.1f} {unit}", f"{link['floor']:.{digits}f}"]
        assert f"| {' | '.join([*row, *(pair(model, digits) for model in models)])} |" in words(
            "real_data"
        )


def test_no_transfer_function_is_recommended(arm):
    assert not any(link["recommended"] for link in arm["links"].values())
    regulators = [link for name, link in arm["links"].items() if "regulator" in name]
    for link in regulators:
        chosen = link["models"][link["chosen"]]
        assert chosen["status"] == "degenerate"
        assert "L" not in chosen["estimates"]
        assert 0.59 < chosen["estimates"]["wn1"] < 0.63  # the page: 0.6 rad/s
        assert chosen["estimates"]["zeta1"] < 0.01
        assert chosen["rms"] > 3 * link["floor"]


def test_the_diagnosis_is_the_recorded_one(arm):
    found = arm["diagnosis"]
    assert f"The verdict is `{found['verdict']}`" in words("real_data")
    valves, delay = found["effects"]
    for effect, family in ((valves, "valve"), (delay, "command_delay")):
        assert (effect["family"], effect["level"]) == (family, "family")
    ratio = valves["physical"]["relative_change_venting"]
    low, high = ratio["interval95"]
    assert f"{1 + ratio['value']:.2f} [{1 + low:.2f}, {1 + high:.2f}] times" in words("real_data")
    lag = delay["sizes"]["valve.line_lag"]
    low, high = lag["interval95"]
    assert f"{lag['value']:.2f} [{low:.2f}, {high:.2f}] s" in words("real_data")
    gap = found["gap"]["lifter.pressure"]
    before, after = (gap[key] / gap["floor"] for key in ("before", "after"))
    assert f"{before:.1f} to {after:.1f} floors" in words("real_data")


def test_the_middle_rests_higher_on_the_later_day(arm):
    link = arm["links"]["height of the middle"]
    moved = link["models"][link["chosen"]]["constant_moved"]
    assert f"the constant of the middle is {moved:.0f} mm higher" in words("real_data")
