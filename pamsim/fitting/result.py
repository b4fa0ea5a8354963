"""The result of ``fit``: fitted laws, their ranking, and a section of a rig with the numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pamsim.core.encoding import INLINE, fields_to_dict, to_dict, write_json
from pamsim.core.files import complete_file
from pamsim.core.units import FloatArray
from pamsim.fitting.curve_fit import CurveFit
from pamsim.fitting.held_out import HeldOut
from pamsim.fitting.params_section import params_text
from pamsim.fitting.search_comparison import SearchRun
from pamsim.fitting.summary import summary_lines

SCHEMA = "pamsim-fit/2"


@dataclass(frozen=True, kw_only=True)
class FittedLaw:
    """One law fitted to one set of points.

    Attributes:
        model: name of the law.
        part: ``rising`` or ``falling`` branch; empty for all points.
        title: of the law, for people.
        equation: in plain text.
        source: paper and equation.
        unit: of the measured quantity [SI].
        points: the points, what was measured and what is predicted there, each shape (n,).
        fit: coefficients, scores.
        held_out: errors at held-out points, or None.
        notes: what a reader must know before using the numbers.
        given: geometry the law was evaluated with, name -> value and unit [SI].
    """

    model: str
    part: str = ""
    title: str
    equation: str
    source: str
    unit: str
    points: Mapping[str, FloatArray]
    fit: CurveFit = field(metadata=INLINE)
    held_out: HeldOut | None = None
    notes: tuple[str, ...] = ()
    given: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class FitResult:
    """Laws fitted to a measured table.

    Attributes:
        file: the table.
        kind: ``force_map``, ``length_loop`` or ``force_loops``.
        compared: whether the laws were ranked.
        notes: what was assumed.
        warnings: where the best of the ranked laws does not generalise.
        fits: best first.
        skipped: law -> why it does not suit the data.
        searches: on the cost of force-displacement loops.
        section: rig section -> key -> word or number, ready for ``params.toml``.
    """

    file: str
    kind: str
    compared: bool = False
    notes: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    fits: tuple[FittedLaw, ...]
    skipped: Mapping[str, str] = field(default_factory=dict)
    searches: tuple[SearchRun, ...] = ()
    section: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def summary(self) -> str:
        """The ranking, if there is one, and every coefficient: some lines of text."""
        return "\n".join(summary_lines(self.to_dict()))

    def to_dict(self) -> dict[str, Any]:
        """JSON-safe form, SI."""
        return to_dict({"schema": SCHEMA, **fields_to_dict(self)})

    def save(self, folder: str | Path) -> list[Path]:
        """Write ``fit.json`` and ``params.toml``, the section of a rig, into a folder.

        Args:
            folder: created if need be; files of the same names are replaced.

        Returns:
            The files written.

        Raises:
            InputError: if the place cannot be written.
        """
        result = Path(folder) / "fit.json"
        write_json(result, self.to_dict())
        return [result, self.save_parameters(folder)]

    def save_parameters(self, folder: str | Path) -> Path:
        """Write ``params.toml``, the section of a rig, into a folder.

        Raises:
            InputError: if the place cannot be written.
        """
        path = Path(folder) / "params.toml"
        with complete_file(path) as part:
            part.write_text(params_text(self.to_dict()), encoding="utf-8")
        return path
