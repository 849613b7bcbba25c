"""Slots of every mode that works here."""

from functools import partial

import pytest

from labkit.course.grading.contract import Limits
from labkit.course.grading.sandbox.host import MODES, SAFE, SandboxError, open_sandbox

LIMITS = Limits(seconds=0.6, total_seconds=20.0)


def opened(mode, limits=LIMITS):
    try:
        return open_sandbox(mode, limits)
    except SandboxError as why:  # it names what to install
        pytest.skip(str(why))


@pytest.fixture(scope="session", params=MODES)
def sandbox(request):
    with opened(request.param) as slot:
        yield slot


@pytest.fixture(params=MODES)
def patient_sandbox(request):
    """One with a student's own limits, for what takes long on a busy machine."""
    with opened(request.param, Limits()) as slot:
        yield slot


@pytest.fixture(scope="session", params=SAFE)
def safe_mode(request):
    """The name of a safe mode that works here."""
    opened(request.param).close()
    return request.param


@pytest.fixture(scope="session")
def slot():
    """One slot of the strongest mode: for what does not depend on the mode."""
    with opened("auto") as strongest:
        yield strongest


@pytest.fixture
def open_slot():
    """Open a slot of the strongest mode with limits of the test's own."""
    return partial(opened, "auto")
