"""The list of contents of a page, from its headings."""

import re
from itertools import count

from markupsafe import Markup

PLACE = '<nav aria-label="Contents"></nav>'
_HEADING = re.compile(r"<h2>(.*?)</h2>")


def with_contents(page: str) -> str:
    """A page whose headings ``<h2>`` have names to link to, and are listed at :data:`PLACE`."""
    entries = {}

    def named(match: re.Match) -> str:
        words = re.sub(r"[^a-z0-9]+", "-", Markup(match[1]).striptags().lower()).strip("-")
        name = next(one for k in count(1) if (one := words if k == 1 else f"{words}-{k}") not in entries)
        entries[name] = match[1]
        return f'<h2 id="{name}">{match[1]}</h2>'

    page = _HEADING.sub(named, page)
    items = "".join(f'<li><a href="#{name}">{title}</a></li>' for name, title in entries.items())
    return page.replace(PLACE, f"{PLACE.removesuffix('</nav>')}<ol>{items}</ol></nav>", 1)
