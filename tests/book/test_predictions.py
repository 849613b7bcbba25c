"""The rules of a prediction: what it asks for, and which boxes are refused."""

from __future__ import annotations

import pytest
from docutils import nodes
from predictions import PredictionError, mark


def box(answer: str | None, choices: int = 0, dropdowns: int = 1) -> nodes.admonition:
    """A prediction whose dropdown has the answer in bold."""
    built = nodes.admonition("", nodes.paragraph("", "What happens?"), classes=["predict"])
    if choices:
        items = [nodes.list_item("", nodes.paragraph("", f"{i}")) for i in range(choices)]
        built += nodes.enumerated_list("", *items)
    for _ in range(dropdowns):
        bold = [] if answer is None else [nodes.strong("", answer)]
        text = nodes.paragraph("", "", *bold, nodes.Text(" This."))
        built += nodes.container("", text, design_component="dropdown")
    return built


@pytest.mark.parametrize(
    ("answer", "choices", "kinds"),
    [
        ("2.", 3, ["predict-answer-2"]),
        ("3", 3, ["predict-answer-3"]),
        ("0.35 m", 0, ["predict-number"]),
        ("−12°", 0, ["predict-number"]),
        ("40 %", 0, ["predict-number"]),
        ("(62 %, 5 %)", 0, ["predict-place", "predict-at-62-5"]),
    ],
)
def test_the_answer_decides_what_is_asked_for(answer, choices, kinds):
    prediction = box(answer, choices)
    mark(prediction)
    assert prediction["classes"] == ["predict", *kinds]


KINDS = "must be a choice, a number or a place"


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        (box("4.", choices=3), "with 3 choices .* got '4.'"),
        (box("0", choices=3), "with 3 choices .* got '0'"),
        (box(None, choices=3), "with 3 choices .* got ''"),
        (box("(60, 35)"), KINDS),
        (box("many"), KINDS),
        (box(None), KINDS),
        (box("(62 %, 105 %)"), r"got '\(62 %, 105 %\)'"),  # outside the picture
        (box("1.", dropdowns=0), "needs one dropdown, got 0"),
        (box("1.", dropdowns=2), "needs one dropdown, got 2"),
    ],
)
def test_what_cannot_be_asked_for_is_refused(asked, message):
    with pytest.raises(PredictionError, match=message):
        mark(asked)
