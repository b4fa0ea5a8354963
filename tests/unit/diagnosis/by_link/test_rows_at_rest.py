"""Effects in rows at rest are found, named as deep as it holds, and not found where there are none.

The fits, the search and the names are those of recordings.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pamsim.comparison.candidate import Probe
from pamsim.comparison.rest_simulator import LinkSimulator, RestSimulator
from pamsim.core.computation import Steps
from pamsim.core.errors import InputError
from pamsim.diagnosis.by_link.diagnose_rest import RestFitter, diagnose_rest
from pamsim.diagnosis.by_link.left_out import LeftOut
from pamsim.diagnosis.by_link.link_fit import LinkFitter
from pamsim.diagnosis.by_link.promise import Signature
from pamsim.diagnosis.by_link.search import search
from pamsim.diagnosis.by_link.units import whole_trials
from pamsim.inference.blocks import Block
from pamsim.inference.coloured_noise import ArNoise
from pamsim.inference.row_tests import nearest_units
from tests.unit.diagnosis.by_link.toy_table import (
    LIBRARY,
    LOCK,
    NOISE,
    SOFTEN,
    TILT,
    Table,
    candidate,
    diagnosed,
    levels,
    measured,
    simulator,
)

TABLE = Table()
COPY = candidate("copy", 0.03, -0.3, 0.3, family="soften")
OTHER = candidate("copy", 0.03, -0.3, 0.3, family="other")


@pytest.mark.parametrize(
    ("hidden", "nuisance"),
    [
        ({"lock": 1.5}, ["gain"]),
        ({"soften": 0.1}, ["gain"]),
        ({"tilt": 1.5}, ["gain"]),
        ({"lock": 1.5, "soften": 0.1}, ["gain"]),
        ({"lock": 1.5}, []),
    ],
    ids=str,
)
def test_hidden_effects_are_named_and_sized(hidden, nuisance):
    found = diagnosed(TABLE, measured(TABLE, hidden), nuisance=nuisance)
    assert levels(found) == dict.fromkeys(hidden, "form")
    for name, truth in hidden.items():
        assert found.model.values[name] == pytest.approx(truth, rel=0.15)
    (link,) = found.links
    assert found.after[link] < 1.5 < 4.0 < found.before[link]


@pytest.mark.parametrize("rows", [12, 24])
def test_nothing_is_named_for_noise_alone(rows):
    """At most 2 % are claimed: two of twenty would be a chance of 1 in 17, three of 1 in 140."""
    table = Table(rows)
    claimed = [bool(diagnosed(table, measured(table, {}, seed=s)).effects) for s in range(20)]
    assert sum(claimed) <= 1


def test_rows_that_scatter_more_at_high_pressure_name_nothing():
    claimed = 0
    for seed in range(10):
        scatter = np.random.default_rng([seed, 9]).standard_normal(TABLE.step.size)
        angle = TABLE.angle({}) + NOISE * scatter * np.where(TABLE.low > 2.0, 6.0, 1.0)
        claimed += bool(diagnosed(TABLE, angle, seed=seed).effects)
    assert claimed <= 2


@pytest.mark.parametrize(("copy", "level"), [(COPY, "family"), (OTHER, "place")])
def test_an_effect_with_the_same_signature_ends_the_name_above_it(copy, level):
    found = diagnosed(TABLE, measured(TABLE, {"soften": 0.1}), (*LIBRARY, copy))
    ((name, certain),) = levels(found).items()
    assert name in ("soften", "copy")
    assert certain == level


@pytest.mark.parametrize("seed", [104, 106])
def test_a_rival_to_which_the_effect_adds_something_does_not_tie(seed):
    """Though a few rows hold the difference of the losses, so that their flips do not show it."""
    assert levels(diagnosed(TABLE, measured(TABLE, {"tilt": 1.5}, seed=seed))) == {"tilt": "form"}


def test_of_two_effects_the_one_without_a_rival_keeps_its_name():
    angle = measured(TABLE, {"soften": 0.1, "lock": 1.5})
    found = levels(diagnosed(TABLE, angle, (*LIBRARY, OTHER)))
    assert found.pop("lock") == "form"
    assert list(found.values()) == ["place"]


def test_a_truth_outside_the_library_is_not_named_something_else():
    assert diagnosed(TABLE, measured(TABLE, {"wave": 0.06})).effects == ()


def test_the_order_of_the_rows_changes_nothing():
    angle = measured(TABLE, {"lock": 1.5, "soften": 0.1})
    order = np.random.default_rng(1).permutation(TABLE.step.size)
    one, other = diagnosed(TABLE, angle), diagnosed(TABLE.taken(order), angle[order])
    assert levels(one) == levels(other)
    for a, b in zip(one.effects, other.effects, strict=True):
        assert a.gain == pytest.approx(b.gain, rel=1e-3)
        assert a.p_value == b.p_value


def test_losses_of_rows_left_out_are_those_of_refits():
    """Squares of the errors, in units of the spread with which the others predict the row.

    Of a row with far more load than all others the fit follows nearly everything.
    """
    far = TABLE.taken(np.arange(TABLE.step.size))
    far.load[0] = 40.0
    hidden = {"lock": 1.5, "tilt": 1.5}
    fitter = RestFitter(simulator(far, measured(far, hidden, noise=1e-3)), ["gain"])
    searched = search(fitter, [LOCK, TILT], steps=Steps(None, 1))
    unseen = LeftOut(fitter, searched.tried.known, nearest_units(fitter.simulator.inputs))
    ((_, losses),) = unseen.losses(searched.model).items()
    jacobian = searched.model.jacobian()
    assert jacobian[0] @ np.linalg.inv(jacobian.T @ jacobian) @ jacobian[0] > 0.95
    for i in range(TABLE.step.size):
        keep = np.arange(TABLE.step.size) != i
        shift, *_ = np.linalg.lstsq(jacobian[keep], -searched.model.rows[keep], rcond=None)
        error = searched.model.rows[i] + jacobian[i] @ shift
        spread = 1.0 + jacobian[i] @ np.linalg.inv(jacobian[keep].T @ jacobian[keep]) @ jacobian[i]
        assert losses[i] == pytest.approx(error**2 / spread, rel=1e-6)
        assert unseen.errors(searched.model)[i] == pytest.approx(1e-2 * error, rel=1e-6)


def unseen_of(angle, known=()):
    """Fitter without nuisance parameters, and its rows left out."""
    fitter = RestFitter(simulator(TABLE, angle), [])
    return fitter, LeftOut(fitter, known, nearest_units(fitter.simulator.inputs))


def fitted(fitter, *effects):
    start = {name: value for one in effects for name, value in one.probes[0].values.items()}
    return fitter.fit(fitter.stated, effects, start, fitter.simulator.links)


def test_beyond_the_noise_nothing_is_left_where_nothing_is_missing():
    left = []
    for seed in range(40):
        fitter, unseen = unseen_of(measured(TABLE, {}, seed=seed))
        for model in (fitter.stated, fitted(fitter, TILT)):
            left += unseen.beyond_noise(model).values()
    assert np.mean(left) == pytest.approx(0.0, abs=4.0 * np.sqrt(2.0 / (40 * TABLE.step.size)))


def test_an_effect_is_as_certain_as_the_best_of_all_that_was_tried_lets_it_be():
    """But for what the model without it has already, or has the parameters of."""
    same = dataclasses.replace(SOFTEN, effect=dataclasses.replace(SOFTEN.effect, name="same"))
    p_values = {}
    for tried in (None, candidate("any", 1.0, 0.0, 9.0), SOFTEN, same):
        known = [
            Signature(effect=tried, probe=Probe(size=1.0, values={}), rows=drawn)
            for drawn in np.random.default_rng(1).normal(size=(300 * bool(tried), TABLE.step.size))
        ]
        fitter, unseen = unseen_of(measured(TABLE, {"tilt": 0.4}), known)
        model, rest = fitted(fitter, SOFTEN, TILT), fitted(fitter, SOFTEN)
        found = unseen.better(model, rest, fitter.simulator.links)
        p_values[tried and tried.name] = found.p_value
        equal = unseen.worse(model, model, rest, fitter.simulator.links)
        assert (equal.gain, equal.p_value) == (0.0, 1.0)
    assert p_values["any"] > 2.0 * p_values[None]
    assert p_values[None] == p_values["soften"] == p_values["same"]


def test_the_noise_of_rows_is_what_the_best_model_leaves_per_degree_of_freedom():
    """First the refitted rig, then what each search finds, until the next finds the same."""
    table = Table(200)
    angle = measured(table, {"gain": 0.11, "lock": 0.5})
    stated, taken = [], []

    def simulator_at(variance, exact_at):
        stated.append(variance)
        taken.append(exact_at)
        return simulator(table, angle, variance)

    found = diagnose_rest(simulator_at, (LOCK,), ["gain"])
    off = table.angle({}) - angle
    gain = table.angle({}) / np.linalg.norm(table.angle({}))
    base = off @ off - (off @ gain) ** 2
    expected = [1.0, np.mean(off**2), base / 199.0, NOISE**2]
    assert stated == pytest.approx(expected, rel=0.2)
    assert stated[2] == pytest.approx(expected[2], rel=1e-3)
    assert taken[:3] == [{}] * 3
    assert taken[3] == pytest.approx({"gain": 0.11, "lock": 0.5}, rel=0.1)
    assert found.gap("x", 10.0, 1.0).before == pytest.approx(10.0 * np.sqrt(base / 199.0), rel=0.02)
    assert found.gap("x", 10.0, 1.0).after == pytest.approx(10.0 * NOISE, rel=0.2)


def test_a_simulator_of_rows_is_one_of_links():
    """Rows of units that are not asked for stay as they were."""
    angle = measured(TABLE, {})
    rows: LinkSimulator = simulator(TABLE, angle)
    others = np.full(TABLE.step.size, 7.0)
    link = frozenset(rows.links)
    whole, part, none = (
        rows.residuals([{"lock in muscle and joint": 1.0}], [links], others, only=only)[0]
        for links, only in ((link, None), (link, {"row 3"}), (frozenset(), None))
    )
    assert whole == pytest.approx(TABLE.angle({"lock": 1.0}) - angle)
    assert np.flatnonzero(part != 7.0).tolist() == [3]
    assert np.array_equal(none, others)
    assert [group.name for group in rows.repeats] == list(TABLE.names)


def test_a_formula_is_certain_only_if_near_rows_miss_nothing_together():
    """An angle that bends off every formula leaves the family certain, and no more."""
    bent = 0.03 * np.sin(1.5 * TABLE.step)
    found = diagnosed(TABLE, measured(TABLE, {"lock": 3.0}) + bent, (LOCK,))
    assert levels(found) == {"lock": "family"}
    (judged,) = found.effects
    assert not judged.exact
    (left,) = found.remainders.values()
    assert left.p_value < 0.01


def test_a_parameter_at_the_end_of_its_range_is_not_free_to_follow_the_other_rows():
    short = candidate("soften", 0.01, 0.0, 0.05)
    fitter = RestFitter(simulator(TABLE, measured(TABLE, {"soften": 0.1})), ["gain"])
    model = fitter.fit(fitter.stated, (short,), {"soften": 0.04}, fitter.simulator.links)
    assert model.values["soften"] == pytest.approx(0.05, rel=0.01)
    (gain,) = (column for name, column in model.sensitivities.items() if name != "soften")
    left = model.rows - gain * (gain @ model.rows) / (gain @ gain)
    unseen = LeftOut(fitter, (), nearest_units(fitter.simulator.inputs))
    alone = 1e-2 * left / (1.0 - gain**2 / (gain @ gain))
    assert unseen.errors(model) == pytest.approx(alone, rel=1e-6)


def test_rows_that_are_too_few_without_a_prediction_or_in_one_unit_are_refused():
    few = TABLE.taken(np.arange(4))
    with pytest.raises(InputError, match="4 rows: 5 or more are needed"):
        diagnosed(few, measured(few, {}))
    with pytest.raises(InputError, match="no position at rest"):
        diagnosed(TABLE, np.full(TABLE.step.size, np.nan))
    angle = measured(TABLE, {})
    rows = simulator(TABLE, angle)
    rows.blocks = (
        Block(unit="row 0", channel="angle", rows=slice(0, 2), noise=ArNoise((), 1e-4)),
        *rows.blocks[2:],
    )
    rows.link_of = rows.link_of[1:]
    with pytest.raises(InputError, match="a unit of its own"):
        diagnose_rest(lambda *_: rows, [LOCK], ["gain"])


def test_a_fit_along_a_curved_valley_is_begun_from_several_sizes():
    """A stiffness times an exponential: from a small start one fit ends before the bottom."""
    step, truth = TABLE.step, {"lock": 1.3, "soften": 0.02}

    def angle(values):
        grown = values.get("soften", 0.0) * np.expm1(values.get("lock", 0.0) * np.abs(step))
        return values.get("gain", 0.12) * step - np.sign(step) * grown

    measured_angle = angle(truth)
    known = simulator(TABLE, measured_angle)
    rows = RestSimulator(
        lambda sets: [angle(values) - measured_angle for values in sets],
        known.blocks,
        known.inputs,
        {"gain": 0.12},
    )
    lock, soften = LOCK, candidate("soften", 0.1, 0.0, 1.0)
    both = dataclasses.replace(
        lock,
        parameters=lock.parameters + soften.parameters,
        neutral={"lock": 0.0, "soften": 0.0},
        probes=(Probe(size=1.0, values={"lock": 0.5, "soften": 0.1}),),
    )
    start = {"lock": 0.01, "soften": 0.9}
    alone = LinkFitter(rows, ["gain"], whole_trials(rows, ()), finer=0.01)
    several = RestFitter(rows, ["gain"])
    one, best = (f.fit(f.stated, (both,), start, rows.links) for f in (alone, several))
    assert best.cost < 0.1 < one.cost
