"""Writing the assignment again gives what is committed, and poor questions are refused."""

import json
import math
import re
from copy import copy
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from labkit.course.assignment import FOLDER
from labkit.course.authoring.compute import (
    draw_case,
    hidden_cases,
    objection_to,
    visible_cases,
)
from labkit.course.authoring.questions import QUESTIONS
from labkit.course.authoring.write import cases_file, course_file, questions_file
from labkit.course.exercises.entries import ENTRIES
from labkit.support.errors import LabkitError

IDS = [one.right.__name__ for one in QUESTIONS]


def same(a, b):
    """Whether two JSON trees agree, floats to seven digits: another BLAS rounds otherwise."""
    if isinstance(a, float) or isinstance(b, float):
        return math.isclose(a, b, rel_tol=1e-7, abs_tol=1e-7)
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, list):
        return len(a) == len(b) and all(map(same, a, b))
    return a == b


@cache
def committed(name):
    return json.loads((FOLDER / name).read_text("utf-8"))


@pytest.mark.parametrize("entry", QUESTIONS, ids=IDS)
def test_what_is_committed_is_what_would_be_written(entry):
    """Of each question the text, the visible cases and the solution."""
    asked, visible = entry.asked_for, visible_cases(entry)
    (text,) = json.loads(questions_file([asked]))["questions"]
    assert text in committed("questions.json")["questions"]
    cases = json.loads(cases_file({asked.id: visible}))["cases"][asked.id]
    assert same(cases, committed("visible.json")["cases"][asked.id])
    right = committed("hidden/course.json")["right"]
    assert right[asked.id] == json.loads(course_file([entry]))["right"][asked.id]


def test_a_solution_that_its_oracle_contradicts_is_refused():
    entry = copy(ENTRIES["fitness"])
    entry.oracle = lambda kept: 1.0 - kept.mean()
    with pytest.raises(LabkitError, match=r"'three of four', will do: the solution and its oracle"):
        visible_cases(entry)


def test_a_secret_and_a_number_lead_to_the_same_cases_again():
    """Cases that are cheap to draw; without the secret they are those committed."""
    for id in ("rotation", "distance_gate", "fitness"):
        visible = visible_cases(ENTRIES[id])
        drawn = [
            json.loads(cases_file({id: hidden_cases(ENTRIES[id], visible, secret=secret)}))
            for secret in (b"", b"a secret", b"a secret")
        ]
        assert same(drawn[0]["cases"][id], committed("hidden/cases.json")["cases"][id])
        assert drawn[0] != drawn[1] == drawn[2]


@pytest.mark.parametrize("id", ["has_converged", "is_plausible"])
def test_each_condition_is_tried_both_ways(id, assignment):
    """A constant passes no group of flags."""
    answers: dict[str, set[bool]] = {}
    for case in assignment.hidden[id]:
        answers.setdefault(case.group, set()).add(bool(case.expected[0]))

    assert len(answers) == {"has_converged": 5, "is_plausible": 4}[id]
    assert all(both == {True, False} for both in answers.values())


def test_cases_that_do_not_tell_mistakes_apart_are_refused():
    entry = ENTRIES["overlap"]
    assert "is taken for" in objection_to(entry, visible_cases(entry)[1:])


def test_cases_by_which_a_mistake_costs_next_to_nothing_are_refused(assignment):
    cases = assignment.cases("has_converged")
    ungrouped = [replace(case, group="") for case in cases]
    assert objection_to(ENTRIES["has_converged"], cases) == ""

    objection = objection_to(ENTRIES["has_converged"], ungrouped)

    assert re.search(r"keeps 4\.\d+ of 5 points; add hidden cases", objection)


HANGING = {
    "distance_gate": (np.array([0.3]), 0.3 + 1e-9),  # the gate but for its last digits
    "align": (far := 0.01 * np.random.default_rng(0).uniform(-1.0, 1.0, (20, 2)) + 50.0, far / 3.0),
}


@pytest.mark.parametrize("id", HANGING)
def test_a_case_that_hangs_on_a_rounding_is_not_used(id):
    """A tie, and a lever of two centimetres fifty metres away."""
    with pytest.raises(LabkitError, match=rf"no draw of {id}, 'a case', will do: its answer hangs"):
        draw_case(ENTRIES[id], "v1", "a case", HANGING[id], np.random.default_rng(0))
