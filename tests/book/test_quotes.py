"""What the pages quote from the sources is still there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

PAGES = Path(__file__).parents[2] / "book"
QUOTE = re.compile(r"```\{literalinclude\} (?P<file>\S+)\n(?P<options>(?::.*\n)*)")
MARKER = re.compile(r":(?:start-at|start-after|end-at|end-before): (.*)")
QUOTES = [
    pytest.param(page.parent / found["file"], found["options"], id=f"{page.name}:{found['file']}")
    for page in sorted(PAGES.glob("*.md"))
    for found in QUOTE.finditer(page.read_text("utf-8"))
]


@pytest.mark.parametrize(("source", "options"), QUOTES)
def test_a_quote_begins_and_ends_at_lines_that_exist(source, options):
    """The build would say so, too, but takes minutes."""
    text = source.read_text("utf-8")
    for marker in MARKER.findall(options):
        assert marker in text, f"{source.name}: no line with {marker!r}"
    for name in re.findall(r":pyobject: (\w+)", options):
        assert re.search(rf"(?m)^(def|class) {name}\b", text), f"{source.name}: no {name}"
