"""Predictions: the reader commits to an answer before the page shows it.

How to write one, in a Markdown cell or on a page; plain MyST, no directive of the book's own::

    ::::{admonition} Predict first
    :class: predict

    The gate closes from 0.5 m to 0.1 m. What becomes of the kept pairs?

    1. All of them stay.
    2. The long ones go, the others stay.
    3. None is left.

    :::{dropdown} What happens
    **2.** A pair is kept if it is shorter than the gate; no other stage has changed.
    :::
    ::::

Mind the colons: the outer fence has one more than the inner one. The box holds exactly one
dropdown, and the dropdown's first bold text is the answer. It decides what the reader is
asked for:

- *A choice*: the box holds a numbered list, and the answer is the number of the right item,
  ``**2.**``. Draw the order of the items by lot: over the book no place is right more than half of
  the time. An answer that holds in one scene only says "here" and asks for a reason that holds
  everywhere; `tests/claims` tries the others on other samples.
- *A number*: no numbered list, and the answer is a number with its unit, ``**0.35 m**``. The
  reader types a number in that unit.
- *A place*: no numbered list, and the answer is a place in the picture above the box, in percent
  of its width and its height from its lower left corner, ``**(62 %, 35 %)**``. The reader clicks
  in the picture, or types the two numbers.

All that follows the box, to the next heading or the next box, may tell the answer: the page holds
it back until the reader has answered or has opened the dropdown. It keeps its place: a widget
stands still, all else but code is blurred. A switch at the head of the page shows all answers, and
so does ``?answers`` in its address.

In JupyterLab and on paper the same text is a box with a question, a list, and a dropdown
to open; nothing is held back there. In the page all of it works by keyboard, and the
reader's answers stay in the browser (`predictions.js`). A box that does not follow these
rules is a warning, and so stops the build.
"""

from __future__ import annotations

import re

from docutils import nodes
from folds import is_dropdown
from sphinx.application import Sphinx
from sphinx.util import logging

CLASS, SWITCH = "predict", "predict-switch"
PLACE = re.compile(r"\((\d{1,3})\s*%,\s*(\d{1,3})\s*%\)")
NUMBER = re.compile(r"[-+\N{MINUS SIGN}]?\d+([.,]\d+)?\s*\D{0,8}")

logger = logging.getLogger(__name__)


class PredictionError(ValueError):
    """A box that breaks the rules above; the message says which."""


def mark(box: nodes.admonition) -> None:
    """Tell the page what a prediction asks for, by classes.

    Raises
    ------
    PredictionError
        For a box without its dropdown, or a dropdown without a usable answer.
    """
    dropdowns = [child for child in box.children if is_dropdown(child)]
    if len(dropdowns) != 1:
        raise PredictionError(f"a prediction needs one dropdown, got {len(dropdowns)}")
    bold = next(iter(dropdowns[0].findall(nodes.strong)), None)
    answer = bold.astext().strip() if bold else ""
    lists = [child for child in box.children if isinstance(child, nodes.enumerated_list)]
    if lists:
        count = len(lists[0].children)
        choice = answer.rstrip(".")
        if not (choice.isdecimal() and 1 <= int(choice) <= count):
            raise PredictionError(
                f"the dropdown of a prediction with {count} choices must begin with the number "
                f"of the right one in bold, like **1.**, got {answer!r}"
            )
        lists[0]["classes"].append("predict-choices")
        box["classes"].append(f"predict-answer-{choice}")
    elif place := PLACE.fullmatch(answer):
        if max(map(int, place.groups())) > 100:
            raise PredictionError(
                f"a place lies in the picture, from (0 %, 0 %) to (100 %, 100 %), got {answer!r}"
            )
        box["classes"] += ["predict-place", "predict-at-{}-{}".format(*place.groups())]
    elif NUMBER.fullmatch(answer):
        box["classes"].append("predict-number")
    else:
        raise PredictionError(f"the answer must be a choice, a number or a place, got {answer!r}")


def mark_all(app: Sphinx, doctree: nodes.document) -> None:
    """Mark every prediction of a page, and leave room for the switch below its title."""
    boxes = [box for box in doctree.findall(nodes.admonition) if CLASS in box["classes"]]
    for box in boxes:
        try:
            mark(box)
        except PredictionError as error:
            logger.warning(str(error), location=box)
    title = next(iter(doctree.findall(nodes.title)), None)
    if boxes and title is not None:
        title.parent.insert(1, nodes.raw("", f'<div class="{SWITCH}"></div>', format="html"))
