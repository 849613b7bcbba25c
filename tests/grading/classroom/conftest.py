"""Verdicts to export: a good one, a bad one, and one with hostile texts."""

import pytest

from tests.grading.verdicts import case, question, submission

HOSTILE = '=HYPERLINK("x")\x00\x1b[31m <script>alert(1)</script> ]]> \ud800 é'


def asked(id, points, share, reason="", hidden_reason=""):
    cases = case("1", 0.0 if reason else 1.0, reason, hidden=False), case("2", share, hidden_reason)
    message = "" if share == 1.0 else f"About {id}."
    return question(id, points, share * points, *cases, message=message)


@pytest.fixture
def verdicts():
    wide = asked("gate", 2.0, 0.25, "A wide gate: it returned a list.", "Off by one metre.")
    return [
        submission("4711", asked("gate", 2.0, 1.0), asked("huber", 3.0, 1.0)),
        submission(
            "815", wide, asked("huber", 3.0, 0.0, "Not defined.", "Not defined."), notes=("a note",)
        ),
        submission("=cmd|x", asked("gate", 2.0, 0.0, HOSTILE, HOSTILE), notes=(HOSTILE,)),
    ]
