"""The assignment as it is committed."""

import pytest

from labkit.course.assignment import load_assignment


@pytest.fixture(scope="session")
def assignment():
    return load_assignment()
