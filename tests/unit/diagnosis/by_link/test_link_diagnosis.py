"""Effects planted in two links are found in theirs, judged by trials that no fit has seen."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from pamsim.comparison.chain_runs import COARSE, MIDDLE, in_link
from pamsim.core.errors import InputError
from pamsim.diagnosis.by_link import judge
from pamsim.diagnosis.by_link.held_out import HeldOut, refuse_unjudged
from pamsim.diagnosis.by_link.promise import forms_of, signatures
from pamsim.diagnosis.by_link.search import search
from pamsim.diagnosis.by_link.sizes import sizes
from pamsim.diagnosis.by_link.units import whole_trials
from pamsim.inference.projection import orthonormal
from tests.unit.diagnosis.by_link.toy_chain import (
    AIR,
    ARMLINK,
    STEPS,
    ToyChain,
    diagnosed,
    fitter_of,
    tried,
)

EFFECTS = tried(
    "valve_delay", "line_lag", "air_leak", "pressure_lag", "passive_stiffness", "added_inertia"
)
DELAY, STIFFNESS = 8e-3, 1.15 * 9237.0


def stiffness_fit(chain):
    """Fitter, and the chain's stiffness fitted from the first probe."""
    fitter = fitter_of(chain)
    (effect,) = tried("passive_stiffness:softening")
    fit = fitter.fit(fitter.stated, (effect,), effect.probes[0].values, {ARMLINK})
    gone = effect.neutral["passive.stiffness"]
    return fitter, fit, fit.values["passive.stiffness"] - gone, STIFFNESS - gone


def test_effects_of_two_links_are_both_certain_to_the_name():
    chain = ToyChain(EFFECTS, {"valve.delay": DELAY, "passive.stiffness": STIFFNESS})
    _, model, found = diagnosed(chain, EFFECTS)
    assert set(found) == {"valve_delay", "passive_stiffness"}
    assert all(one.level() in ("name", "form") for one in found.values())
    assert model.values["valve.delay"] == pytest.approx(DELAY, rel=0.05)
    assert model.values["passive.stiffness"] == pytest.approx(STIFFNESS, rel=0.05)


def test_nothing_is_found_where_nothing_is_planted():
    claims = [diagnosed(ToyChain(EFFECTS, seed=seed), EFFECTS)[2] for seed in range(10)]
    assert not any(claims)


class BreaksDown(ToyChain):
    """A chain that cannot be simulated with a delay on the inputs that are held out."""

    def residuals(self, sets, links, others, *, only=None, steps=1):
        found = super().residuals(sets, links, others, only=only, steps=steps)
        unseen = only is not None and bool({f"{n.split('_')[0]}_0" for n in self.held_out} & only)
        return [
            None if unseen and values.get("valve.delay", 0.0) > 0.0 else residual
            for values, residual in zip(sets, found, strict=True)
        ]


def test_a_model_that_breaks_down_on_unseen_inputs_predicts_nothing_and_ends_nothing():
    planted = {"valve.delay": 0.02, "joint.shaft.armature": 0.01}
    chain = BreaksDown(EFFECTS, planted)
    _, model, found = diagnosed(chain, EFFECTS)
    assert "valve_delay" not in found
    assert found["added_inertia"].certain()["name"]
    assert "valve.delay" not in model.values


def test_an_effect_whose_place_is_not_certain_explains_nothing():
    chain = ToyChain(EFFECTS, {"valve.delay": DELAY, "passive.stiffness": STIFFNESS})
    fitter = fitter_of(chain)
    searched, unseen = search(fitter, EFFECTS, steps=STEPS), HeldOut(fitter)
    model, found = judge.judge(searched, unseen)
    unsure = [replace(o, p_value=1.0) if o.effect.name == "valve_delay" else o for o in found]
    left = unseen.remainders(judge.claimed(searched, model, unsure))
    assert left[AIR].counts
    assert not left[ARMLINK].counts
    left = unseen.remainders(judge.claimed(searched, model, found))
    assert not left[AIR].counts
    none = [replace(one, p_value=1.0) for one in found]
    assert judge.claimed(searched, model, none) is searched.base


@pytest.mark.parametrize(
    ("small", "name"),
    [({"valve.delay": 2e-3}, "valve_delay"), ({"joint.shaft.armature": 1e-3}, "added_inertia")],
)
def test_a_small_effect_beside_a_large_one_is_found_in_another_link_and_the_same(small, name):
    planted = {"passive.stiffness": 2.0 * STIFFNESS, **small}
    _, _, found = diagnosed(ToyChain(EFFECTS, planted), EFFECTS)
    assert set(found) == {"passive_stiffness", name}
    assert found["passive_stiffness"].gain > 100.0 * found[name].gain


def test_of_formulas_that_fit_as_well_the_one_with_fewer_parameters_is_taken():
    creep = tried("viscoelastic_creep")
    # Two branches of one relaxation time are one branch.
    same = {"creep.stiffness_2": "creep.stiffness", "creep.relaxation_time_2": "nothing"}
    chain = ToyChain(creep, {"creep.stiffness": 400.0}, same=same)
    fitter = fitter_of(chain)
    one, two = (
        fitter.fit(fitter.stated, (form,), form.probes[0].values, {ARMLINK}) for form in creep
    )
    assert two.cost < one.cost
    assert one.criterion < two.criterion


def test_an_effect_whose_usual_form_shows_nothing_is_found_in_another():
    delay, lag, leak, *_ = tried("valve_delay", "pressure_lag", "air_leak")
    as_form = replace(delay.effect, form="of another shape")
    other = replace(leak, effect=as_form, usual=False)
    hidden = {"chamber.leak_conductance": 2e-12, "sensor.pressure_lag": 2e-2}
    _, _, found = diagnosed(ToyChain([delay, lag, leak], hidden), [delay, lag, other])
    assert found["valve_delay"].effect.label == "valve_delay:of another shape"


def test_all_forms_are_known_where_more_is_left_than_the_usual_ones_take_away():
    for bent in (0.0, 2.0):
        chain = ToyChain(EFFECTS, {"passive.stiffness": STIFFNESS}, bent=bent)
        found = search(fitter_of(chain), EFFECTS, steps=STEPS)
        known = {signature.effect.label for signature in found.tried.known}
        assert ("line_lag:limited_rate" in known) == (bent > 0.0)


def test_an_effect_is_found_that_a_nuisance_parameter_stands_in_for_at_first_order():
    class Curved(ToyChain):
        """The force's scale acts as the stiffness does, until it is far from what is stated."""

        def _change(self, values):
            far = max(abs(values.get("force.scale in muscle and joint", 1.0) - 1.0) - 0.1, 0.0)
            return super()._change(values) + far * self._shape("another", ARMLINK)

    planted = {"passive.stiffness": 1.5 * STIFFNESS}
    chain = Curved(EFFECTS, planted, same={"passive.stiffness": "force.scale"})
    _, model, found = diagnosed(chain, EFFECTS)
    assert found["passive_stiffness"].level() in ("name", "form")
    assert model.values["passive.stiffness"] == pytest.approx(1.5 * STIFFNESS, rel=0.05)


def test_a_fit_in_one_link_leaves_no_rows_of_another_behind():
    lag, stiffness = tried("pressure_lag", "passive_stiffness:softening")
    planted = {"sensor.pressure_lag": 8e-3, "passive.stiffness": STIFFNESS}
    chain = ToyChain([lag, stiffness], planted)
    fitter = fitter_of(chain)
    first = fitter.fit(fitter.stated, [lag], {"sensor.pressure_lag": 4e-3}, {AIR, ARMLINK})
    start = {"passive.stiffness": STIFFNESS}
    both = fitter.fit(first, [lag, stiffness], start, {ARMLINK})
    np.testing.assert_allclose(both.rows, fitter.everywhere(both).rows, atol=1e-6)
    assert both.values["sensor.pressure_lag"] == pytest.approx(8e-3, rel=0.05)


@pytest.mark.parametrize(
    ("similar", "level"),
    [
        ("valve.line_lag", "family"),
        ("chamber.leak_conductance", ""),
        # A sensor's error would be seen in the other link, too.
        ("sensor.pressure_lag", "form"),
    ],
)
def test_a_name_is_as_deep_as_its_rivals_let_it_be(similar, level):
    same = {similar: "valve.delay"}
    _, _, found = diagnosed(ToyChain(EFFECTS, {"valve.delay": DELAY}, same=same), EFFECTS)
    (one,) = found.values()
    assert one.level() == level


class Resembling(ToyChain):
    """The delay changes pressures as a larger dead volume does, and otherwise, too."""

    def __init__(self, otherwise):
        self._otherwise = otherwise
        super().__init__(EFFECTS, {"valve.delay": DELAY})

    def _shape(self, name, link):
        if name != "valve.delay":
            return super()._shape(name, link)
        volume = super()._shape("chamber.dead_volume", link)
        return volume + self._otherwise * super()._shape("another", link)


@pytest.mark.parametrize(("otherwise", "explained"), [(0.3, True), (3.0, False)])
def test_a_number_of_the_rig_that_explains_an_effect_as_well_is_found(otherwise, explained):
    fitter = fitter_of(Resembling(otherwise))
    searched, unseen = search(fitter, EFFECTS, steps=STEPS), HeldOut(fitter)
    case = judge.Case(searched.tried, unseen, unseen.beyond_noise(searched.base))
    model, (one,) = judge.needed_effects(case, searched.model)
    found = judge.number_instead(case, model, one)
    assert (found is not None) == explained
    if found is not None:
        assert found.parameter == in_link("chamber.dead_volume", AIR)
        # In units of its own size each moves the same.
        moved = model.values["valve.delay"] / fitter.scale("valve.delay", model.effects)
        assert found.value == pytest.approx((1.0 + moved) * found.stated, rel=0.1)
        assert found.share == pytest.approx(1.0 - 0.3**2 / (1.0 + 0.3**2), abs=0.05)


def test_an_error_of_the_formula_leaves_the_family_certain_and_a_large_one_nothing():
    exact, bent, far = (
        diagnosed(ToyChain(EFFECTS, {"passive.stiffness": STIFFNESS}, bent=bent), EFFECTS)[2][
            "passive_stiffness"
        ]
        for bent in (0.0, 0.3, 2.0)
    )
    assert (exact.exact, bent.exact, bent.level(), far.level()) == (True, False, "family", "")
    assert 0.5 < far.share < bent.share < 0.99


def test_a_small_effect_is_not_certain_beside_what_is_left_and_does_not_count():
    planted = {"passive.stiffness": 9237.0 + 150.0}
    one = diagnosed(ToyChain(EFFECTS, planted, bent=0.1), EFFECTS)[2]["passive_stiffness"]
    assert one.exact
    assert 0.0 == one.left < one.uncounted < one.gain < 2.0 * one.uncounted
    assert one.level() == ""


def test_two_effects_take_the_place_of_one_that_leaves_what_they_do_not():
    """One of a family that is between the two is found first, and its family is then free."""
    planted = {"valve.delay": DELAY, "valve.line_lag": 2e-3}
    _, _, found = diagnosed(ToyChain(EFFECTS, planted), EFFECTS)
    assert {name: one.exact for name, one in found.items()} == {
        "valve_delay": True,
        "line_lag": True,
    }


def test_what_another_formula_of_the_family_takes_away_does_not_count_against_it(monkeypatch):
    planted = {"valve.delay": DELAY, "valve.line_lag": 2e-3}
    monkeypatch.setattr(judge, "pairs_of_effects", lambda *_: [])
    _, _, found = diagnosed(ToyChain(EFFECTS, planted), EFFECTS)
    (one,) = found.values()
    assert one.level() == "family"
    assert one.left < 0.1 < 5.0 < one.before - one.gain


def test_an_error_of_a_formula_may_look_like_its_family_and_be_another_in_every_input():
    chain = ToyChain(EFFECTS, {"valve.delay": DELAY})
    fitter = fitter_of(chain)
    known = signatures(fitter, fitter.stated, [(e, e.probes[0]) for e in EFFECTS])
    (delay,) = (effect for effect in EFFECTS if effect.name == "valve_delay")
    model = fitter.fit(fitter.stated, (delay,), {"valve.delay": DELAY}, {AIR})
    basis = orthonormal(forms_of(fitter, model, known))

    def left(rows):
        return np.linalg.norm(rows - basis @ (basis.T @ rows)) / np.linalg.norm(rows)

    of = {signature.effect.name: signature.rows for signature in known}
    assert left(of["line_lag"]) < 1e-6
    assert left(of["air_leak"]) > 0.1
    own = model.sensitivities["valve.delay"]
    assert left(own * (fitter.units.fitted.group_of == fitter.units.fitted.group_of[0])) < 1e-6


@pytest.mark.parametrize("error", [0.1, -0.25])
def test_long_time_steps_of_the_search_do_not_end_in_the_size(error):
    class InLongSteps(ToyChain):
        def residuals(self, sets, links, others, *, only=None, steps=COARSE):
            found = super().residuals(sets, links, others, only=only)
            if steps == MIDDLE:
                return found
            return [r + error * (r - self.stated) * (r != others) for r in found]

    chain = InLongSteps(EFFECTS, {"passive.stiffness": STIFFNESS})
    _, _, found, planted = stiffness_fit(chain)
    assert found == pytest.approx(planted, rel=0.03)


def test_an_interval_lies_about_what_time_steps_of_zero_would_find():
    class InSteps(ToyChain):
        def residuals(self, sets, links, others, *, only=None, steps=COARSE):
            found = super().residuals(sets, links, others, only=only)
            return [r - 0.005 * steps * (r - self.stated) * (r != others) for r in found]

    chain = InSteps(EFFECTS, {"passive.stiffness": STIFFNESS})
    fitter, fit, found, _ = stiffness_fit(chain)
    reach = []
    for _ in range(2):
        reach += [one.interval95[1] - one.value for one in sizes(fitter, fit).values()]
        chain.residuals = super(InSteps, chain).residuals  # the same in all steps
    assert reach[1] - reach[0] == pytest.approx(0.005 * MIDDLE * found, rel=0.2)


def test_a_nuisance_parameter_has_a_value_in_each_link_and_stays_where_nothing_shows_it():
    chain = ToyChain(EFFECTS)
    chain._same = {"force.scale": "nothing"}
    fitter = fitter_of(chain)
    assert set(fitter.nuisance) == {
        "force.scale in valves and air",
        "force.scale in muscle and joint",
        "chamber.dead_volume in valves and air",
    }
    chain._shape = lambda name, link: 0.0 * chain.stated
    unseen = fitter_of(chain)
    fit = unseen.fit(unseen.stated, (), {}, {ARMLINK})
    assert fit.values == pytest.approx(unseen.nuisance)


def test_held_out_trials_are_not_seen_by_any_fit():
    planted = {"valve.delay": DELAY}
    chain, other = ToyChain(EFFECTS, planted), ToyChain(EFFECTS, planted)
    for block in other.blocks:
        if block.unit in other.held_out:
            other.stated[block.rows] += 100.0
    fitters = [fitter_of(one) for one in (chain, other)]
    assert fitters[0].stated.rows == pytest.approx(fitters[1].stated.rows)
    fits = [f.fit(f.stated, EFFECTS[:1], {"valve.delay": 5e-3}, f.simulator.links) for f in fitters]
    assert fits[0].values == pytest.approx(fits[1].values)


def delay_interval(delay, seed=0):
    """95 % interval of a delay that was planted [s]."""
    chain = ToyChain(EFFECTS[:1], {"valve.delay": delay}, seed=seed)
    fitter = fitter_of(chain)
    model = fitter.fit(fitter.stated, EFFECTS[:1], {"valve.delay": delay}, chain.links)
    return sizes(fitter, model)["valve.delay"].interval95


def test_intervals_hold_what_was_planted_as_often_as_they_say():
    ends = np.array([delay_interval(DELAY, seed) for seed in range(40)])
    # Of 40 intervals of 95 %, 35 or more hold it with a probability of 97 %.
    assert np.sum((ends[:, 0] <= DELAY) & (ends[:, 1] >= DELAY)) >= 35


def test_an_interval_ends_where_the_range_of_its_parameter_does():
    low, high = delay_interval(1e-6)
    assert low == EFFECTS[0].parameters[0].low == 0.0 < high < DELAY


def test_an_interval_is_wider_where_the_formula_is_not_exact():
    def width(bent):
        chain = ToyChain(EFFECTS, {"passive.stiffness": STIFFNESS}, bent=bent)
        fitter, fit, *_ = stiffness_fit(chain)
        return np.ptp(sizes(fitter, fit)["passive.stiffness"].interval95)

    assert width(1.0) > 3.0 * width(0.0)


def ragged(planted, without):
    """A chain of which some trials do not measure the last link, as those without load cells."""

    class Ragged(ToyChain):
        def units(self, limits):
            pairs = zip(self.blocks, self.link_of, strict=True)
            kept = [(b, n) for b, n in pairs if n == 0 or not without(self, b.unit)]
            blocks, link_of = zip(*kept, strict=True)
            shown = SimpleNamespace(repeats=self.repeats, blocks=blocks, link_of=link_of)
            return whole_trials(shown, self.held_out, limits=limits)

    return Ragged(tried("pressure_lag"), planted)


def test_trials_that_do_not_measure_a_link_are_judged_by_the_others():
    (effect,) = tried("pressure_lag")
    planted = effect.probes[0].values
    for without in (
        lambda chain, unit: unit.endswith("2"),
        lambda chain, unit: unit not in chain.held_out,
    ):
        _, model, found = diagnosed(ragged(planted, without), [effect])
        assert found["pressure_lag"].links <= {AIR, ARMLINK}
        assert found["pressure_lag"].level()
        assert model.values == pytest.approx({**model.values, **planted}, rel=0.05)


def test_a_link_that_no_judged_trial_measures_is_refused_by_name():
    chain = ragged({}, lambda chain, unit: unit in chain.held_out)
    with pytest.raises(InputError, match=r"muscle and joint \(pressure to position\)"):
        refuse_unjudged(fitter_of(chain))
