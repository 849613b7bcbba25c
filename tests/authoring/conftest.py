"""The assignment as it is committed, and submissions that are run in this process."""

import importlib
import pkgutil

import pytest

from labkit.authoring import variants
from labkit.grading.assignment import load_assignment

VARIANTS = [module.name for module in pkgutil.iter_modules(variants.__path__)]


@pytest.fixture(scope="session")
def assignment():
    return load_assignment()


@pytest.fixture(params=VARIANTS)
def variant(request):
    """A whole submission, all of it right."""
    return importlib.import_module(f"labkit.authoring.variants.{request.param}")
