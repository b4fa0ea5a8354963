"""One log, or two repeats of each input: nothing is claimed that they do not show, with a note."""

import itertools
from types import SimpleNamespace

import pytest

from pamsim.comparison.noise_floor import FloorRoute
from pamsim.diagnosis.by_link.diagnose_links import evidence_notes
from pamsim.diagnosis.by_link.held_out import HeldOut
from pamsim.diagnosis.by_link.judged_units import held_out_split, judged_trials
from pamsim.diagnosis.by_link.limits import USUAL
from tests.unit.diagnosis.by_link.toy_chain import ToyChain, ToyLog, diagnosed, tried

EFFECTS = tried("valve_delay", "air_leak", "passive_stiffness", "added_inertia")
DELAY, STIFFNESS = 8e-3, 1.15 * 9237.0


class Twice(ToyChain):
    """Two repeats of each input, the second of which is held out."""

    names = tuple(f"t{group}_{k}" for group in range(8) for k in range(2))

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        self.held_out = [name for name in self.names if name.endswith("1")]


def test_one_log_shows_a_cause_to_the_family():
    fitter, model, found = diagnosed(ToyLog(EFFECTS, {"valve.delay": DELAY}), EFFECTS)
    assert {name: one.level() for name, one in found.items()} == {"valve_delay": "family"}
    assert not found["valve_delay"].exact
    assert model.values["valve.delay"] == pytest.approx(DELAY, rel=0.1)
    unseen = HeldOut(fitter)
    losses = unseen.losses(model)
    for link, left in unseen.remainders(model).items():
        assert (left.known, left.p_value) == (False, 1.0)
        assert left.excess == pytest.approx(losses[link].mean() - 1.0)


def test_a_cause_that_resembles_what_differs_is_found_if_it_is_far_larger():
    planted = {"passive.stiffness": 2.0 * 9237.0}
    assert set(diagnosed(ToyLog(EFFECTS, planted), EFFECTS)[2]) == {"passive_stiffness"}


def test_what_differs_from_log_to_log_is_not_claimed():
    """Measured with 200 logs: 0 claims; without `varying` 29 of 40."""
    logs = [ToyLog(EFFECTS, seed=seed, variation=2.0) for seed in range(4)]
    assert not any(diagnosed(log, EFFECTS)[2] for log in logs)
    units = logs[0].units
    logs[0].units = lambda limits: units(limits, assumed=0.0)
    assert "passive_stiffness" in diagnosed(logs[0], EFFECTS)[2]


def test_a_fitted_repeat_shows_whether_the_formula_is_exact():
    planted = {"passive.stiffness": STIFFNESS}
    exact = diagnosed(Twice(EFFECTS, planted), EFFECTS)[2]["passive_stiffness"]
    assert exact.exact
    assert exact.level() in ("name", "form")
    bent = diagnosed(Twice(EFFECTS, planted, bent=0.5), EFFECTS)[2]["passive_stiffness"]
    assert not bent.exact
    assert bent.level() == "family"


def held_out(trials):
    return held_out_split(SimpleNamespace(trials=trials), ())[0]


def trial(name, protocol, load=0.0):
    return SimpleNamespace(name=name, protocol=protocol, load=load)


def test_another_load_is_no_repeat():
    alternating = [trial(f"{k}_{load}", "step", load) for k in range(2) for load in (0.0, 1.2)]
    assert held_out(alternating) == ("1_0.0", "1_1.2")
    assert held_out(alternating[:2]) == ()


def test_of_many_inputs_that_were_recorded_once_those_judged_are_stated_as_held_out():
    once = [trial(f"t{k}", f"p{k}") for k in range(12)]
    assert held_out(once) == tuple(judged_trials(once, ())) != ()
    assert held_out(once[:9]) == ()


def judged(*repeats):
    """So many held-out trials of each input."""
    units = [f"{i}_{k}" for i, count in enumerate(repeats) for k in range(count)]
    return SimpleNamespace(
        judged=SimpleNamespace(units=units),
        input=lambda unit: unit[0],
        in_parts=False,
        varies=False,
        limits=USUAL,
    )


def share_of_signs(*repeats):
    """Share of all signs of trials under which no product of two repeats changes its sign."""
    every = itertools.product((-1, 1), repeat=sum(repeats))
    ends = list(itertools.accumulate(repeats))
    own = [slice(end - count, end) for end, count in zip(ends, repeats, strict=True)]
    unchanged = [all(len(set(signs[rows])) == 1 for rows in own) for signs in every]
    return sum(unchanged) / len(unchanged)


@pytest.mark.parametrize("repeats", [(5,), (3, 3), (4, 2), (2, 2, 2)])
def test_the_smallest_p_value_is_that_of_all_signs(repeats):
    (note,) = evidence_notes({}, judged(*repeats))
    printed = float(note.partition("p = ")[2].split()[0])
    assert printed == pytest.approx(
        2.0 * share_of_signs(*repeats), rel=0.05
    )  # two tests, two digits


def test_enough_trials_need_no_note():
    assert evidence_notes({}, judged(3, 3, 3, 3)) == ()
    # Each beside a fitted one.
    assert evidence_notes({}, judged(1, 1, 1, 1, 1, 1)) == ()
    (note,) = evidence_notes({}, judged(1, 1, 1, 1, 1))
    assert "5 held-out trials" in note
    assert float(note.partition("p = ")[2].split()[0]) == pytest.approx(
        2.0 * share_of_signs(2, 2, 2, 2, 2), rel=0.02
    )


@pytest.mark.parametrize(
    ("source", "advice"),
    [(FloorRoute.REPEATS, "hold out 5 trials"), (FloorRoute.HOLDS, "record every input three")],
)
def test_parts_of_trials_come_with_advice_on_what_would_decide(source, advice):
    noise = {("air", "pressure"): SimpleNamespace(source=source)}
    found = SimpleNamespace(**{**vars(judged(2)), "in_parts": True})
    *_, last = evidence_notes(noise, found)
    assert advice in last
