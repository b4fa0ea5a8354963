"""Every printed number of the papers, recomputed from what is printed: one list of claims."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping

from pamsim.core.errors import InputError, PamsimError, nearest
from pamsim.papers.alraouf2025 import claims as paper_b
from pamsim.papers.claim import Claim
from pamsim.papers.matiskova2021 import claims as paper_a
from pamsim.papers.nguyen2024 import claims as paper_c
from pamsim.papers.sarosi import claims as paper_e
from pamsim.papers.vandamme2008 import claims as paper_d

PAPERS: Mapping[str, Callable[[], list[Claim]]] = {
    "A": paper_a.claims,
    "B": paper_b.claims,
    "C": paper_c.claims,
    "D": paper_d.claims,
    "E": paper_e.claims,
}
"""Letter of a paper -> what recomputes it. A further paper is one more line."""


def replicate(papers: Iterable[str] | None = None) -> list[Claim]:
    """Recompute the papers.

    Args:
        papers: letters of the papers wanted; all that are known if left out.

    Returns:
        The claims, paper by paper.

    Raises:
        InputError: for a letter that is not known.
        PamsimError: if two claims share an id or a paper hands in another's claim.
    """
    wanted = list(PAPERS) if papers is None else list(dict.fromkeys(papers))
    for letter in wanted:
        if letter not in PAPERS:
            raise InputError(f"no paper {letter!r}; {nearest(letter, PAPERS)}")
    found = [(letter, claim) for letter in wanted for claim in PAPERS[letter]()]
    for letter, claim in found:
        if claim.paper != letter:
            raise PamsimError(f"claim {claim.id} was handed in by paper {letter}")
    twice = [id for id, count in Counter(claim.id for _, claim in found).items() if count > 1]
    if twice:
        raise PamsimError(f"claim ids used more than once: {', '.join(sorted(twice))}")
    return [claim for _, claim in found]
