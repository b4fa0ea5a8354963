"""The result of a diagnosis: one shape for recordings, tables at rest and loops."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from pamsim.comparison.compared_signal import Comparison
from pamsim.core.computation import versions
from pamsim.core.encoding import INLINE, NOT_IN_JSON, fields_to_dict, json_property, write_json
from pamsim.core.units import FloatArray
from pamsim.diagnosis.method.verdict import Verdict
from pamsim.diagnosis.method.verdict_thresholds import FAR_NUISANCE
from pamsim.diagnosis.physical_size import PhysicalSize
from pamsim.diagnosis.repaired_rig import RIG_FOLDER, Repair, write_repaired_rig
from pamsim.diagnosis.sentence import verdict_sentence
from pamsim.diagnosis.shared_family import shared_families

SCHEMA = "pamsim-diagnosis/2"
FILE = "diagnosis.json"


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """A fitted parameter, in a readable unit and in SI.

    Attributes:
        value: in ``unit``, as are ``interval95`` and ``before``.
        unit: that of the rig's file.
        interval95: ends of the 95 % interval; None if it is not known.
        value_si: [unit_si].
        unit_si: SI unit.
        interval95_si: [unit_si].
        before: value before the fit; None where there was none.
        at_bound: whether the fit ended at a limit of the parameter's range.
    """

    value: float
    unit: str
    interval95: tuple[float, float] | None = None
    value_si: float
    unit_si: str
    interval95_si: tuple[float, float] | None = None
    before: float | None = None
    at_bound: bool = False


@dataclass(frozen=True, kw_only=True)
class FoundEffect:
    """A claimed effect, or an alternative: a model with one effect or several.

    Attributes:
        members: effect -> what is missing from the base model, as a sentence's end.
        family: effects of one family have similar signatures in most data.
        form: the formula, where the effect was tried in several; else None.
        parameters: name -> estimate.
        physical: its size in terms that do not depend on the form, as quantity -> size; empty for a
            loop, which is fitted without a rig.
        explained: share of the gap that it explains; of several claimed effects, what each explains
            beyond the others.
        p_value: that an effect improves held-out predictions as much by chance, corrected for all
            effects that were tried.
        loss_difference: held-out loss minus that of the best model; None for a claimed effect.
        standard_errors_behind: the same in standard errors; None for a claimed effect.
    """

    members: Mapping[str, str] = field(metadata=NOT_IN_JSON)
    family: str
    form: str | None = None
    parameters: Mapping[str, Estimate]
    physical: Mapping[str, PhysicalSize] = field(default_factory=dict[str, PhysicalSize])
    explained: float | None = None
    p_value: float | None = None
    loss_difference: float | None = None
    standard_errors_behind: float | None = None

    @json_property
    def name(self) -> str:
        """Name of the effect; of several, joined by ``+``."""
        return "+".join(self.members)

    @json_property
    def missing(self) -> str:
        """What is missing, in words."""
        return " and ".join(self.members.values())


@dataclass(frozen=True, kw_only=True)
class Region:
    """A range of one quantity, and the rows that lie in it."""

    quantity: str
    low: float
    high: float
    unit: str
    p_value: float
    rows: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Place:
    """One channel of one protocol, table or loop.

    Attributes:
        channel: such as ``angle``.
        protocol: of the trials; name of the table.
        excess: mean square residual over the noise variance, minus 1; None without repeats.
        p_value: that the residual is noise.
        region: where over the most significant quantity the residual is largest.
    """

    channel: str
    protocol: str
    excess: float | None
    p_value: float
    region: Region | None = None


@dataclass(frozen=True, kw_only=True)
class Resemblance:
    """The effect that resembles most what is missing.

    Attributes:
        name: of the effect; of several, joined by ``+``.
        family: of the effect.
        explained: share of the gap that it explains; to first order where it was not fitted.
        explained_interval95: its 95 % interval; None where it is not known.
        leaves: where what it leaves is largest; None where it was not mapped.
        p_value: as in `FoundEffect`; None where it was not fitted.
        similarity: cosine of its signature and the misfit; None where the data have no signatures.
    """

    name: str
    family: str
    explained: float | None
    p_value: float | None
    explained_interval95: tuple[float, float] | None = None
    leaves: Place | None = None
    similarity: float | None = None


@dataclass(frozen=True, kw_only=True)
class MapEntry:
    """Mean residual, measured minus simulated, over bins of one quantity.

    Attributes:
        channel: such as ``angle``.
        quantity: such as ``speed``.
        unit: of the edges.
        edges: of the bins, (b + 1,).
        mean: (b,) in ``mean_unit``; NaN for an empty bin.
        mean_unit: ``noise SD``, or a unit.
        p_value: that the residual does not depend on the quantity.
        rows: names of a table's rows in each bin.
        rms: (b,) root mean square of the residual of these rows, in ``mean_unit``.
    """

    channel: str
    quantity: str
    unit: str
    edges: FloatArray
    mean: FloatArray
    mean_unit: str
    p_value: float
    rows: tuple[tuple[str, ...], ...] = ()
    rms: FloatArray | None = None


@dataclass(frozen=True, kw_only=True)
class RmsLevel:
    """A root mean square in the channel's unit and in SI, with its 95 % interval if known."""

    value: float
    interval95: tuple[float, float] | None
    value_si: float

    @classmethod
    def scaled(
        cls, value: float, scale: float, interval95: tuple[float, float] | None = None
    ) -> RmsLevel:
        """A level [SI] in the channel's unit.

        Args:
            value: [SI].
            scale: factor of that unit on SI.
            interval95: [SI].
        """
        ends = None if interval95 is None else (interval95[0] * scale, interval95[1] * scale)
        return cls(value=value * scale, interval95=ends, value_si=value)


@dataclass(frozen=True, kw_only=True)
class GapEntry:
    """One channel on held-out data.

    Attributes:
        unit: of the levels.
        floor: noise; None if it is not known.
        before: residual of the refitted base model.
        after: residual of the best model; None where the verdict repairs nothing.
        as_it_stands: residual of the rig as it was given, where that was simulated.
    """

    unit: str
    floor: RmsLevel | None
    before: RmsLevel
    after: RmsLevel | None
    as_it_stands: RmsLevel | None = None


@dataclass(frozen=True, kw_only=True)
class AbsentEntry:
    """How large an effect that is not claimed could be.

    Attributes:
        parameter: that measures its size.
        limit: largest distance of the parameter from neutral that the data allow, in ``unit``; None
            where the data cannot tell.
        unit: of the limit.
        limit_si: the same in SI.
        typical_sizes: the limit in typical sizes of the effect; NaN if not known.
        because: why the data cannot tell; None where they can.
    """

    parameter: str
    limit: float | None
    unit: str
    limit_si: float | None
    typical_sizes: float
    because: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """``ruled_out_above`` with its unit, or ``cannot_tell``."""
        if self.limit is None:
            return {"parameter": self.parameter, "cannot_tell": True, "because": self.because}
        return {
            "parameter": self.parameter,
            "ruled_out_above": self.limit,
            "unit": self.unit,
            "ruled_out_above_si": self.limit_si,
            "typical_sizes": None if np.isnan(self.typical_sizes) else self.typical_sizes,
        }


@dataclass(frozen=True, kw_only=True)
class NextStep:
    """What to measure next.

    Attributes:
        protocol: experiment on the menu; None where only advice can be given.
        advice: in words, whatever the rig.
        shows: what the protocol shows.
        between: names of the models that it separates.
        before: mean square distance of these on the data at hand, over the noise variance.
        after: the same on a trial of the protocol.
        menu: experiment -> the same for all.
    """

    protocol: str | None
    advice: str
    shows: str = ""
    between: tuple[str, ...] = ()
    before: float | None = None
    after: float | None = None
    menu: Mapping[str, float] = field(default_factory=dict[str, float])


@dataclass(frozen=True, kw_only=True)
class TriedModel:
    """A model that was fitted.

    Attributes:
        effects: names.
        form: see `FoundEffect`.
        held_out: error at held-out data, in ``unit``.
        unit: ``noise variance`` for a mean square over it (1 is perfect), else that of a root mean
            square.
        in_sample: the same at fitted data, where it was computed.
        gain: fall of the held-out loss from the base model [noise variance].
        gain_error: its standard error.
        p_value: as in `FoundEffect`.
        p_value_unseen: of no improvement at rows or readings left out.
        accepted: whether its effects may be claimed.
        at_bound: parameters that ended at a limit.
        size_known: whether the intervals exclude the effects' absence.
        parameters: of the effects, where they are cheap to state for all models.
    """

    effects: tuple[str, ...]
    form: str | None = None
    held_out: float
    unit: str
    in_sample: float | None = None
    gain: float | None = None
    gain_error: float | None = None
    p_value: float
    p_value_unseen: float | None = None
    accepted: bool
    at_bound: tuple[str, ...] = ()
    size_known: bool | None = None
    parameters: Mapping[str, Estimate] = field(default_factory=dict[str, Estimate])


@dataclass(frozen=True, kw_only=True)
class NuisanceEntry:
    """A parameter refitted with every effect: in the rig, refitted alone, and with the best model.

    Values are in ``unit``; ``interval95`` and ``at_bound`` are of the last, or of the one before
    where there is none.
    """

    parameter: str
    unit: str
    before: float
    refitted: float
    with_effects: float | None
    interval95: tuple[float, float] | None
    at_bound: bool

    @property
    def last(self) -> float:
        """Value in the model that the verdict rests on."""
        return self.refitted if self.with_effects is None else self.with_effects

    @json_property
    def far(self) -> bool:
        """Whether it left the rig's value so far, or its range, that it may hide an effect."""
        return self.at_bound or abs(self.last - self.before) > FAR_NUISANCE * abs(self.before)


@dataclass(frozen=True, kw_only=True)
class Details:
    """What only some kinds of data show; empty or None for the others.

    Attributes:
        remainder: excess over the noise that the best model leaves [noise variance].
        lack_of_fit: size [noise variance] and p-value of what repeats share that the best model,
            or without one the base model, does not predict, the smallest p-value that they can
            reach, and the level that counts.
        noise_floor: per channel its standard deviation, from how many repeats, and by which route
            (`pamsim.comparison.noise_within_trial.FloorRoute`).
        where_with_measured_pressures: as ``where``, with the arm driven by the measured pressures.
        nuisance_by_protocol: nuisance parameters fitted to each protocol by itself.
        loop_areas: areas of hysteresis loops in the recordings.
        spectrum: residuals of periodic protocols by spectral lines.
        screened: what the data can show of every effect before any is fitted.
        floor_is: what the noise floor stands for where there are no repeats.
        in_sample: root mean square residual at the fitted data, before and after.
        rows: of a table, with the errors of each.
        balances: rows that were solved for their balance of torques.
        branches: of a loop, rising and falling output at every level: measured, of the reversible
            curve, and of the model that predicts unseen readings best, claimed or not.
        forms_as_good: other forms of the best effect that predict as well.
    """

    remainder: float | None = None
    lack_of_fit: Mapping[str, Any] | None = None
    noise_floor: Mapping[str, Any] | None = None
    where_with_measured_pressures: tuple[Place, ...] = ()
    nuisance_by_protocol: tuple[Mapping[str, Any], ...] = ()
    loop_areas: tuple[Mapping[str, Any], ...] = ()
    spectrum: tuple[Mapping[str, Any], ...] = ()
    screened: tuple[Mapping[str, Any], ...] = ()
    floor_is: str | None = None
    in_sample: Mapping[str, RmsLevel | None] | None = None
    rows: tuple[Mapping[str, Any], ...] = ()
    balances: int | None = None
    branches: Mapping[str, Any] | None = None
    forms_as_good: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """Where simulation and data disagree, and which effect is missing.

    Attributes:
        kind: ``recordings``, ``table`` or ``loop``.
        rig: name; None for a loop.
        data: where the measurements are from.
        verdict: see `Verdict`.
        effects: those claimed; none where the verdict claims none.
        certain: effects that the best model and all alternatives share.
        resembles: the effect that resembles most what is missing; None if nothing is missing.
        alternatives: models that predict as well as the best, which comes first if none is claimed;
            none where every effect is rejected: the size of one would only stand in for the cause.
        where: where the base model misses, the largest first.
        maps: residual of the base model over quantities, the most significant first.
        maps_after: the same of the best model or the one that resembles most, where it was mapped.
        gap: channel -> residual on held-out data.
        absent: effect that is not claimed -> how large it could be.
        warnings: what a reader should know, one sentence each.
        next_experiment: what to measure next; None if the question is settled.
        explained: share of the gap that the best model explains.
        explained_interval95: its 95 % interval, from the scatter of trials, rows or levels; None
            where it is not known.
        inconclusive: why the data carry no verdict; None if they do.
        effects_tried: number of effects that were compared.
        tried: models that were fitted, the best first.
        nuisance: parameters refitted with every effect.
        held_out: names of what was held out.
        held_out_method: how.
        skipped: effect -> why it was not tried.
        details: what only this kind of data shows; written in place.
        seed: random seed.
        rollouts: simulations.
        parameter_sets: parameter sets that were simulated or predicted.
        seconds: wall time.
        repaired_rig: folder of the repaired rig once it is saved.
        method: result of the method, with all fits.
        comparisons: measured and simulated signals for the page.
        repair: what the repaired rig is written from; None if no single repair follows.
    """

    kind: str
    rig: str | None
    data: tuple[str, ...]
    verdict: Verdict
    effects: tuple[FoundEffect, ...]
    certain: tuple[str, ...]
    resembles: Resemblance | None
    alternatives: tuple[FoundEffect, ...]
    where: tuple[Place, ...]
    maps: tuple[MapEntry, ...]
    maps_after: tuple[MapEntry, ...] = ()
    gap: Mapping[str, GapEntry]
    absent: Mapping[str, AbsentEntry]
    warnings: tuple[str, ...]
    next_experiment: NextStep | None
    explained: float
    explained_interval95: tuple[float, float] | None = None
    inconclusive: str | None = None
    effects_tried: int
    tried: tuple[TriedModel, ...]
    nuisance: tuple[NuisanceEntry, ...]
    held_out: tuple[str, ...]
    held_out_method: str
    skipped: Mapping[str, str]
    details: Details = field(metadata=INLINE)
    seed: int
    rollouts: int
    parameter_sets: int
    seconds: float
    repaired_rig: Path | None = None
    method: Any = field(default=None, repr=False, metadata=NOT_IN_JSON)
    comparisons: tuple[Comparison, ...] = field(default=(), repr=False, metadata=NOT_IN_JSON)
    repair: Repair | None = field(default=None, repr=False, metadata=NOT_IN_JSON)

    @json_property
    def sentence(self) -> str:
        """The verdict as one plain sentence."""
        return verdict_sentence(self)

    @json_property
    def certain_families(self) -> dict[str, dict[str, PhysicalSize]]:
        """Family that all tied models share, though not the effect -> quantity -> size.

        The interval of a size contains those of all tied models.
        """
        if self.verdict is not Verdict.AMBIGUOUS or self.certain:
            return {}
        return shared_families(self.alternatives)

    @json_property
    def gap_over_floor(self) -> dict[str, float | None]:
        """Residual over noise floor, as a root mean square over the channels."""
        return {"before": self.over_floor(repaired=False), "after": self.over_floor(repaired=True)}

    def over_floor(self, *, repaired: bool) -> float | None:
        """Residual over noise floor before or after the repair; None where either is not known."""
        pairs = [(g.after if repaired else g.before, g.floor) for g in self.gap.values()]
        ratios = [a.value_si / b.value_si for a, b in pairs if a is not None and b is not None]
        if self.kind != "recordings" or not ratios:
            return None
        return float(np.sqrt(np.mean(np.square(ratios))))

    def summary(self) -> str:
        """The verdict as one plain sentence."""
        return self.sentence

    def to_dict(self) -> dict[str, Any]:
        """The content of ``diagnosis.json``, schema ``pamsim-diagnosis/2``."""
        return {"schema": SCHEMA, **fields_to_dict(self), "versions": versions("scipy")}

    def save(self, folder: str | Path) -> list[Path]:
        """Write ``diagnosis.json`` and, where one repair follows, the repaired rig.

        Args:
            folder: created if need be.

        Returns:
            The paths written.

        Raises:
            InputError: if the folder cannot be written.
        """
        folder = Path(folder)
        rig = None
        if self.repair is not None:
            rig = write_repaired_rig(self.repair, folder / RIG_FOLDER, self.sentence)
        write_json(folder / FILE, replace(self, repaired_rig=rig).to_dict())
        return [folder / FILE, *([] if rig is None else [rig])]
