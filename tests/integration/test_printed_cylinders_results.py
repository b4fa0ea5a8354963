"""The page on real data quotes the record of the printed cylinders."""

from __future__ import annotations

import numpy as np
import pytest

from tests.records import recorded, words

PAGE = words("real_data")


@pytest.fixture(scope="module")
def cylinders():
    return recorded("results/printed_cylinders")


def test_friction_of_the_seals_is_the_record(cylinders):
    for seal, result in cylinders["seals"].items():
        forces = " | ".join(f"{result['friction'][str(bar)]:.2f}" for bar in (1, 3, 5, 7))
        errors = {
            (held["held_out_bar"], held["model"]): 100.0 * held["error"]
            for held in result["held_out"]
        }
        shown = " | ".join(
            f"{errors[bar, model]:+.0f}, {errors[other, model]:+.0f} %"
            for model in ("in proportion to pressure", "the same at every pressure")
            for bar, other in ((3, 5),)
        )
        assert f"| {seal} | {forces} | {shown} |" in PAGE


def test_friction_grows_with_pressure_at_every_seal(cylinders):
    share, constant = [], []
    for result in cylinders["seals"].values():
        assert result["friction"]["7"] > result["friction"]["1"]
        areas = [result["area"][bar] for bar in ("3", "5", "7")]
        assert max(areas) < 1.03 * min(areas)
        for held in result["held_out"]:
            grows = held["model"] == "in proportion to pressure"
            (share if grows else constant).append(abs(held["error"]))
    assert f"median error at the fourth is {100 * np.median(share):.1f} %" in PAGE
    assert f"{100 * np.median(constant):.1f} % with a constant friction" in PAGE
    assert f"largest {100 * max(share):.0f} %" in PAGE
    assert sum(error > 0.2 for error in share) == 1  # the page: one above 20 %


def test_reruns_scatter_as_the_page_states(cylinders):
    runs = cylinders["repeats"]["friction"]
    assert ", ".join(f"{run['7']:.1f}" for run in runs) in PAGE
    first = cylinders["seals"]["O-ring257"]["friction"]
    assert f"{first['7'] - first['5']:.1f} N" in PAGE
    assert np.ptp([run["7"] for run in runs]) > 0.5 * (first["7"] - first["5"])


def test_friction_over_push_is_small_at_the_o_ring(cylinders):
    ring = cylinders["seals"]["O-ring"]
    ratio = [ring["friction"][b] / (ring["area"][b] * float(b) * 1e5) for b in ("3", "5", "7")]
    assert f"{100 * max(ratio):.1f} % of the push" in PAGE


def test_the_copies_are_copies(cylinders):
    assert all(cylinders["repeats"]["copies"].values())
