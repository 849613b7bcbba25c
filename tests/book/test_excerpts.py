"""What the search finds: each passage of a page once, in the entry that its reader looks for."""

import re
from pathlib import Path

from docutils import nodes
from excerpts import entries


def section(title, *children, id):
    return nodes.section("", nodes.title("", title), *children, ids=[id])


def test_an_exercise_is_one_entry_with_its_text_and_its_section_does_not_repeat_it():
    content = nodes.section("", nodes.paragraph("", "Turn a scan."), ids=["exercise-content"])
    exercise = nodes.admonition(
        "", nodes.title("", "Exercise 1.1 (By hand)"), content, classes=["exercise"], ids=["ex-a"]
    )
    page = section("Rotation", nodes.paragraph("", "Angles."), exercise, id="rotation")

    assert list(entries(page)) == [
        ("rotation", "section", "Rotation", "Angles.", ""),
        ("ex-a", "exercise", "1.1 (By hand)", "Turn a scan.", ""),
    ]


def test_a_row_of_a_table_of_messages_is_an_entry():
    def row(*cells):
        return nodes.row("", *(nodes.entry("", nodes.paragraph("", cell)) for cell in cells))

    head = nodes.thead("", row("what you see", "what it is"))
    body = nodes.tbody("", row("a result of nan", "the run failed"))
    table = nodes.table("", nodes.tgroup("", head, body, cols=2))
    page = section("When something goes wrong", table, id="wrong")

    assert ("wrong", "message", "a result of nan", "the run failed", "") in list(entries(page))


def test_each_word_of_the_glossary_leads_to_where_it_is_explained():
    glossary = Path(__file__).parents[2] / "book" / "glossary.md"
    meanings = re.findall(r"(?m)^\S.*\n((?:  .*\n)+)", glossary.read_text("utf-8"))

    assert len(meanings) > 40
    assert not [text for text in meanings if not re.search(r"\]\((\.\./notebooks/|formats)", text)]
