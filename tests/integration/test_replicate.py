"""``pamsim replicate`` as a user types it: table, JSON, page, exit codes."""

from __future__ import annotations

import json

import pytest

from pamsim.cli.main import main
from pamsim.core.errors import ParameterError
from pamsim.papers import replicate as room
from pamsim.papers.claim import Claim, Verdict, evaluate

KEYS = {
    "id", "paper", "statement", "place", "printed", "recomputed", "unit", "accepted", "scatter",
    "order", "kind", "because", "verdict", "same_as", "reason",
}  # fmt: skip


def run(monkeypatch, capsys, *args):
    monkeypatch.setattr("sys.argv", ["pamsim", "replicate", *args])
    with pytest.raises(SystemExit) as ended:
        main()
    captured = capsys.readouterr()
    return ended.value.code, captured.out, captured.err


def made_up(paper):
    return [
        Claim(
            id=f"{paper}-01",
            paper=paper,
            statement="a statement of words",
            place="text",
            printed="more",
            recomputed=1.0,
            unit="",
            accepted=((None, 0.5),),
            scatter=(),
            order=None,
            kind=Verdict.INDEPENDENT,
            because="it could be less",
            verdict=Verdict.INCONSISTENT,
            same_as=None,
            reason="a finding about the paper",
        )
    ]


@pytest.fixture
def light(monkeypatch):
    """Two papers by their claims that take no time, the others by one claim made up."""
    quick = {"matiskova2021": range(1, 9), "alraouf2025": range(1, 16)}
    claims = {paper: lambda paper=paper: made_up(paper) for paper in room.PAPERS}
    claims |= {
        paper: lambda paper=paper, numbers=numbers: [
            evaluate(f"{paper}-{number:02d}") for number in numbers
        ]
        for paper, numbers in quick.items()
    }
    monkeypatch.setattr(room, "paper_claims", lambda paper: claims[paper]())
    return claims


def test_json_holds_claims_of_every_paper_and_the_counts(light, monkeypatch, capsys, tmp_path):
    file = tmp_path / "result.json"
    code, out, err = run(monkeypatch, capsys, "--json", str(file))
    assert (code, err) == (0, "")
    result = json.loads(file.read_text(encoding="utf-8"))
    assert result["schema"] == "pamsim-replicate/2"
    assert {claim["paper"] for claim in result["claims"]} == set(light)
    assert all(set(claim) == KEYS for claim in result["claims"])
    assert set(result["counts"]) == {verdict.value for verdict in Verdict}
    facts = {(claim["same_as"] or claim["id"], claim["verdict"]) for claim in result["claims"]}
    assert sum(result["counts"].values()) == len(facts) < len(result["claims"])
    assert set(result["versions"]) == {"python", "pamsim", "mujoco", "numpy"}
    assert result["wall_s"] > 0.0
    assert all(claim["id"] in out for claim in result["claims"])
    assert out.splitlines()[-1].startswith(
        f"{len(result['claims'])} claims of {len(facts)} facts: "
    )
    assert "the fact of alraouf2025-04" in out


@pytest.mark.usefixtures("light")
def test_papers_can_be_chosen_in_capitals_and_twice(monkeypatch, capsys, tmp_path):
    file = tmp_path / "result.json"
    code, _, _ = run(
        monkeypatch, capsys, "--paper", "nguyen2024", "--paper", "Nguyen2024", "--json", str(file)
    )
    assert code == 0
    assert [claim["id"] for claim in json.loads(file.read_text())["claims"]] == ["nguyen2024-01"]


@pytest.mark.usefixtures("light")
def test_page_lies_in_the_folder(monkeypatch, capsys, tmp_path):
    code, out, _ = run(
        monkeypatch, capsys, "--paper", "nguyen2024", "--out", str(tmp_path / "page")
    )
    assert code == 0
    assert "page: " in out
    source = (tmp_path / "page" / "index.html").read_text(encoding="utf-8")
    assert 'id="nguyen2024-01"' in source
    assert (tmp_path / "page" / "nguyen2024_order.png").stat().st_size > 1000


def test_a_paper_that_cannot_be_evaluated_gives_1_and_keeps_the_others(
    light, monkeypatch, capsys, tmp_path
):
    def broken():
        raise ParameterError("a number is out of range")

    monkeypatch.setitem(light, "vandamme2008", broken)
    file = tmp_path / "result.json"
    code, out, _ = run(monkeypatch, capsys, "--json", str(file))
    assert code == 1
    assert "FAIL  Van Damme 2008 could not be evaluated: ParameterError: a number is" in out
    result = json.loads(file.read_text(encoding="utf-8"))
    assert [failure["paper"] for failure in result["failures"]] == ["vandamme2008"]
    assert {claim["paper"] for claim in result["claims"]} == set(light) - {"vandamme2008"}


def test_unknown_paper_is_one_line_and_2(monkeypatch, capsys):
    code, out, err = run(monkeypatch, capsys, "--paper", "AB")
    assert (code, out) == (2, "")
    assert err.startswith("pamsim: error: no paper 'ab'; ")
    assert len(err.splitlines()) == 1


def test_a_file_in_place_of_the_folder_is_refused_before_the_work(monkeypatch, capsys, tmp_path):
    file = tmp_path / "file"
    file.write_text("")
    code, _, err = run(monkeypatch, capsys, "--out", str(file))
    assert code == 2
    assert "is a file" in err


def test_help_says_what_the_exit_codes_mean(monkeypatch, capsys):
    code, out, _ = run(monkeypatch, capsys, "--help")
    assert code == 0
    assert "finding about the paper" in " ".join(out.split())


@pytest.mark.slow
def test_every_paper_is_evaluated(monkeypatch, capsys, tmp_path):
    file = tmp_path / "result.json"
    code, _, _ = run(monkeypatch, capsys, "--json", str(file))
    assert code == 0
    result = json.loads(file.read_text(encoding="utf-8"))
    assert {claim["paper"] for claim in result["claims"]} == set(room.PAPERS)
