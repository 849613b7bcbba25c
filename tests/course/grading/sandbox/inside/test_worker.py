"""What is kept of a cell that hung."""

import pytest

from labkit.course.grading.sandbox.inside.worker import definitions


@pytest.mark.parametrize(
    ("line", "kept"),
    [
        ("import numpy as np", True),
        ("from math import pi", True),
        ("GATE = 0.5", True),
        ("limits: tuple = (1, -2)", True),
        ("def f(x):\n    return f(x)", True),
        ("class Scan:\n    pass", True),
        ("result = f(3)", False),
        ("squares = [i for i in endless]", False),
        ("f(3)", False),
        ("while True:\n    pass", False),
        ("for i in f:\n    pass", False),
        ("if f(1):\n    x = 1", False),
        ("with f(1):\n    pass", False),
    ],
)
def test_definitions_stay_and_work_goes(line, kept):
    assert definitions(line) == (line if kept else "")
    assert definitions(f"a = 1\n{line}\nb = 2").endswith("b = 2")
