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
    ("answer", "choices", "kind"),
    [
        ("2.", 3, "predict-answer-2"),
        ("3", 3, "predict-answer-3"),
        ("0.35 m", 0, "predict-number"),
        ("−12°", 0, "predict-number"),
        ("40 %", 0, "predict-number"),
    ],
)
def test_the_answer_decides_what_is_asked_for(answer, choices, kind):
    prediction = box(answer, choices)
    mark(prediction)
    assert prediction["classes"] == ["predict", kind]
    lists = list(prediction.findall(nodes.enumerated_list))
    assert [each["classes"] for each in lists] == [["predict-choices"]] * bool(choices)


@pytest.mark.parametrize(
    ("answer", "got"), [("4.", "'4.'"), ("0", "'0'"), ("b", "'b'"), (None, "''")]
)
def test_an_answer_that_is_no_choice_is_refused(answer, got):
    with pytest.raises(PredictionError, match=f"with 3 choices .* got {got}"):
        mark(box(answer, choices=3))


@pytest.mark.parametrize("answer", ["(60, 35)", "many", "2 of the 5 runs end elsewhere", None])
def test_an_answer_in_words_is_refused(answer):
    with pytest.raises(PredictionError, match="must be a choice, a number or a place"):
        mark(box(answer))


def test_a_place_is_asked_for_by_its_percent_of_the_picture():
    prediction = box("(62 %, 5 %)")
    mark(prediction)
    assert prediction["classes"] == ["predict", "predict-place", "predict-at-62-5"]


def test_a_place_outside_the_picture_is_refused():
    with pytest.raises(PredictionError, match=r"got '\(62 %, 105 %\)'"):
        mark(box("(62 %, 105 %)"))


@pytest.mark.parametrize("count", [0, 2])
def test_a_prediction_has_one_dropdown(count):
    with pytest.raises(PredictionError, match=f"needs one dropdown, got {count}"):
        mark(box("1.", dropdowns=count))
