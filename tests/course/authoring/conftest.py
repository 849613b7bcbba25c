"""The assignment as it is committed, and submissions that are run in this process."""

import pytest
from right_answers import RIGHT

from labkit.course.grading.assignment import load_assignment


@pytest.fixture(scope="session")
def assignment():
    return load_assignment()


@pytest.fixture(params=RIGHT, ids=lambda module: module.__name__)
def variant(request):
    """A whole submission, all of it right."""
    return request.param
