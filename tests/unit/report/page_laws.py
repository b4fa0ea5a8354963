"""What every page keeps to, so that a screen reader, a mail program and a phone can show it."""

from __future__ import annotations

from html.parser import HTMLParser
from itertools import pairwise

_VOID = ("meta", "br", "wbr", "img", "input")


class Page(HTMLParser):
    """Tags with attributes, the visible text, and that of each header cell."""

    def __init__(self, source: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.headers: list[str] = []
        self.text = ""
        self.feed(source)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in _VOID:
            self.open.append(tag)
        if tag == "th":
            self.headers.append("")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if "th" in self.open:
            self.headers[-1] += data.strip()
        if "style" not in self.open and "script" not in self.open:
            self.text += data

    def all(self, tag: str) -> list[dict[str, str | None]]:
        """Attributes of every such tag."""
        return [attrs for name, attrs in self.tags if name == tag]


def check_page(source: str) -> None:
    """Fail a page that is not one file, or that leaves a reader without what it shows.

    Args:
        source: the page.
    """
    page = Page(source)
    assert source.startswith("<!DOCTYPE html>")
    assert page.open == [], "every tag is closed"
    assert ("html", {"lang": "en"}) in page.tags
    assert source.count("<title>") == 1
    assert source.count("<script") <= 1, "no script but the page's own"
    levels = [int(tag[1]) for tag, _ in page.tags if tag in ("h1", "h2", "h3")]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after <= before + 1 for before, after in pairwise(levels))
    ids = [attrs["id"] for _, attrs in page.tags if "id" in attrs]
    assert len(set(ids)) == len(ids)
    assert all(page.headers), "a table's header cell without text"
    for tag, attrs in page.tags:
        if tag == "img":
            assert len(attrs["alt"] or "") > 20
            assert (attrs["src"] or "").startswith("data:"), "a mailed page has no other file"
        if "tabindex" in attrs:
            assert attrs["role"] == "region"
            assert attrs["aria-label"]
        target = attrs.get("href") or ""
        assert not target.startswith("#") or target[1:] in ids, f"no {target} to go to"
        assert not any((attrs.get(at) or "").startswith("http") for at in ("src", "href"))
