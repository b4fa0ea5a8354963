"""The page of the replication: every claim of every paper, and the papers' figures redrawn."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from pamsim.report.numbers import fixed
from pamsim.report.page import PageImage, check_schema, page_template, save_page
from pamsim.report.replication_forces import force_laws, inverse_law
from pamsim.report.replication_loops import loops_by_order, loops_by_test
from pamsim.report.replication_preisach import exact_shape, force_loops, plane_and_loop
from pamsim.report.replication_statics import arctangent_loop, bouc_wen_loop, static_law
from pamsim.report.replication_view import VERDICTS, paper_views, verdict_sentence

SCHEMA = "pamsim-replicate/1"

_Draw = Callable[[Mapping[str, Any]], Figure]

FIGURES: Mapping[str, Mapping[str, _Draw]] = {
    "A": {"a_static": static_law},
    "B": {"b_arctangent": arctangent_loop, "b_bouc_wen": bouc_wen_loop},
    "C": {"c_order": loops_by_order, "c_tests": loops_by_test},
    "D": {"d_plane": plane_and_loop, "d_force": force_loops, "d_exact": exact_shape},
    "E": {"e_laws": force_laws, "e_inverse": inverse_law},
}
"""Letter of a paper -> file without ``.png`` -> what draws it from the paper's curves."""


def write_replication(
    result: Mapping[str, Any], curves: Mapping[str, Mapping[str, Any]], out: Path
) -> list[Path]:
    """Write page and figures of a replication.

    Args:
        result: of schema ``pamsim-replicate/1``, JSON-safe. Keys unknown to this version are
            ignored.
        curves: letter of a paper -> what its figures draw; papers left out get no figures.
        out: folder to write into; made if missing, files of the same names are replaced.

    Returns:
        The files written, the page first.

    Raises:
        InputError: if the result has another schema, or ``out`` is a file.
    """
    check_schema(result, SCHEMA)
    return save_page(
        out, lambda: _figures(curves), lambda images: render_page(result, curves, images)
    )


def _figures(curves: Mapping[str, Mapping[str, Any]]) -> dict[str, Figure]:
    return {
        name: draw(curves[letter])
        for letter, drawings in FIGURES.items()
        if letter in curves
        for name, draw in drawings.items()
    }


def render_page(
    result: Mapping[str, Any],
    curves: Mapping[str, Mapping[str, Any]],
    images: Mapping[str, PageImage],
) -> str:
    """Fill the template.

    Args:
        result: of schema ``pamsim-replicate/1``.
        curves: letter of a paper -> what its figures show; the captions quote numbers from it.
        images: by the names of the files without ``.png``.

    Returns:
        The page; every text from the result is escaped.
    """
    papers = paper_views(result)
    return page_template("replication.html").render(
        papers=papers,
        verdict=verdict_sentence(papers),
        kinds=list(VERDICTS.values()),
        totals=[sum(paper.counts[i] for paper in papers) for i in range(len(VERDICTS))],
        images=images,
        curves=curves,
        fixed=fixed,
        wall=f"{fixed(result.get('wall_s'), 1)} s",
        versions=dict(result.get("versions") or {}),
    )
