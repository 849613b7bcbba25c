"""JavaScript reads as Python does here: lines of at most 100 letters, one declaration each."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = "labkit/interactive", "book/_static", "book/_ext", "tests/interactive"
FILES = sorted(
    path
    for folder in FOLDERS
    for path in (ROOT / folder).rglob("*.*js")
    if "vendor" not in path.parts
)
# A second declaration in one statement: `const a = 1, b = 2;`, on one line.
SECOND = re.compile(r"\s*(?:const|let) [\w$]+ = [^({\[`\"]*, [\w$]+ = .*;")


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_a_line_is_short_and_holds_one_declaration(path):
    lines = path.read_text("utf-8").splitlines()

    assert not [line for line in lines if len(line) > 100 or SECOND.fullmatch(line)]


def test_the_pattern_knows_a_second_declaration():
    assert SECOND.fullmatch("  const a = 1, b = 2;")
    assert not SECOND.fullmatch("  const { a, b } = c;")
