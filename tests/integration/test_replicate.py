"""``pamsim replicate`` as a user types it: table, JSON, page, exit codes."""

import json

import pytest

from pamsim.core.errors import ParameterError
from pamsim.papers import replicate as room
from pamsim.papers.claim import Verdict, evaluate
from tests.typed_command import run as command

KEYS = {
    "id", "paper", "statement", "place", "printed", "recomputed", "unit", "accepted", "scatter",
    "order", "kind", "because", "verdict", "same_as", "reason",
}  # fmt: skip
QUICK = {
    "matiskova2021": range(1, 9), "alraouf2025": range(1, 16), "nguyen2024": [6],
    "vandamme2008": [15], "sarosi": [11],
}  # fmt: skip


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Runs the command: its exit code, output, errors and result."""

    def run(*words):
        file = tmp_path / "result.json"
        json_file = ("--json", file, "--force")
        code, out, err = command(monkeypatch, capsys, "replicate", *words, *json_file)
        return code, out, err, json.loads(file.read_text("utf-8")) if file.exists() else None

    return run


@pytest.fixture
def broken():
    return set()


@pytest.fixture(autouse=True)
def light(request, monkeypatch, broken):
    """The papers by claims that take no time."""

    def claims(paper):
        if paper in broken:
            raise ParameterError("a number is out of range")
        return [evaluate(f"{paper}-{number:02d}") for number in QUICK[paper]]

    if "slow" not in request.keywords:
        monkeypatch.setattr(room, "paper_claims", claims)


def test_json_holds_claims_of_every_paper_and_the_counts(run):
    code, out, err, result = run()
    assert (code, err, result["schema"]) == (0, "", "pamsim-replicate/3")
    claims = result["claims"]
    assert {claim["paper"] for claim in claims} == set(room.PAPERS)
    assert all(set(claim) == KEYS for claim in claims)
    lines = {line.partition(" ")[0]: line for line in out.splitlines()}
    several = [claim for claim in claims if isinstance(claim["recomputed"], list)]
    assert several
    assert all(f" {one['recomputed'][0]:.5g} ... " in lines[one["id"]] for one in several)
    assert set(result["counts"]) == {verdict.value for verdict in Verdict}
    facts = {(claim["same_as"] or claim["id"], claim["verdict"]) for claim in claims}
    assert sum(result["counts"].values()) == len(facts) < len(claims)
    assert set(result["versions"]) == {"python", "pamsim", "mujoco", "numpy"}
    assert result["wall_s"] > 0.0
    assert all(claim["id"] in out for claim in claims)
    assert out.splitlines()[-1].startswith(f"{len(claims)} claims of {len(facts)} facts: ")
    assert "the fact of alraouf2025-04" in out


def test_papers_are_chosen_in_capitals_and_twice_and_their_page_lies_in_the_folder(run, tmp_path):
    page = tmp_path / "page"
    twice = ("--paper", "nguyen2024", "--paper", "Nguyen2024")
    code, out, _, result = run(*twice, "--out", page)
    assert (code, "page: " in out) == (0, True)
    assert [claim["id"] for claim in result["claims"]] == ["nguyen2024-06"]
    assert 'id="nguyen2024-06"' in (page / "index.html").read_text(encoding="utf-8")
    assert (page / "nguyen2024_order.png").stat().st_size > 1000


def test_a_paper_that_cannot_be_evaluated_gives_1_and_keeps_the_others(run, broken):
    broken.add("vandamme2008")
    code, out, _, result = run()
    assert code == 1
    assert "FAIL  Van Damme 2008 could not be evaluated: ParameterError: a number is" in out
    assert [failure["paper"] for failure in result["failures"]] == ["vandamme2008"]
    assert {claim["paper"] for claim in result["claims"]} == set(room.PAPERS) - broken


def test_bad_input_is_one_line_and_2_before_the_work_and_help_says_what_codes_mean(run, tmp_path):
    (tmp_path / "file").write_text("")
    for args, words in (
        (["--paper", "AB"], "pamsim: error: no paper 'ab'; "),
        (["--out", tmp_path / "file"], "is a file"),
    ):
        code, out, err, _ = run(*args)
        assert (code, out, len(err.splitlines())) == (2, "", 1)
        assert words in err
    code, out, *_ = run("--help")
    assert (code, "finding about the paper" in " ".join(out.split())) == (0, True)


@pytest.mark.slow
def test_every_paper_is_evaluated(run):
    code, _, _, result = run()
    assert code == 0
    assert {claim["paper"] for claim in result["claims"]} == set(room.PAPERS)
