"""What a student is told, as HTML: code between backticks, and chapters as links."""

from __future__ import annotations

import re
from html import escape

PAGES = {
    "chapter 1": "notebooks/01_problem_and_se2.html",
    "chapter 2": "notebooks/02_alignment.html",
    "chapter 3": "notebooks/03_correspondences.html",
    "chapter 4": "notebooks/04_icp_loop.html",
    "chapter 5": "notebooks/05_odometry.html",
    "the errata": "book/errata.html",
}
_CHAPTER = re.compile(rf"({'|'.join(PAGES)}), “([^”]+)”")


def to_html(text: str, book: str = "") -> str:
    """Text as HTML: a student's own is escaped, whatever stands in it.

    Parameters
    ----------
    text : str
        As a verdict holds it.
    book : str
        Where the book's pages lie; without it no chapter is a link.

    Examples
    --------
    >>> to_html("`x` < 2; see chapter 1, “Rotation”.")
    '<code>x</code> &lt; 2; see chapter 1, “Rotation”.'
    >>> to_html("chapter 1, “Rotation”", "https://x.org")
    '<a href="https://x.org/notebooks/01_problem_and_se2.html#rotation">chapter 1, “Rotation”</a>'
    """
    html = escape(text)
    if book:
        html = _CHAPTER.sub(lambda found: _link(found, book), html)
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", html)


def _link(found: re.Match[str], book: str) -> str:
    section = re.sub(r"[^a-z0-9]+", "-", found[2].lower()).strip("-")
    page = f"{escape(book).rstrip('/')}/{PAGES[found[1]]}#{section}"
    return f'<a href="{page}">{found[0]}</a>'
