"""Feedback to a student on a verdict, as text and as HTML."""

from __future__ import annotations

import re
from html import escape


def short(value: float) -> str:
    """A score as people write it.

    >>> short(3.0), short(2.5), short(1 / 3)
    ('3', '2.5', '0.33')
    """
    return f"{value:.2f}".rstrip("0").rstrip(".")


def to_html(text: str) -> str:
    """Text as HTML: a student's own is escaped, whatever stands in it.

    >>> to_html("`x` < 2")
    '<code>x</code> &lt; 2'
    """
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(text))
