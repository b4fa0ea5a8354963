"""What every page shares: how templates are filled, and how a page refers to its images."""

from __future__ import annotations

from dataclasses import dataclass

import jinja2


@dataclass(frozen=True)
class PageImage:
    """An image file of the page and the size to show it at [CSS pixel]."""

    file: str
    width: int
    height: int


def page_template(name: str) -> jinja2.Template:
    """A template of this room; every text put into it is escaped.

    Args:
        name: file in ``templates``.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("pamsim.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,  # a name mistyped in the template is an error, not a gap
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(name)
