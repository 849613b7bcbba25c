"""The small assignment, written once a session."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from small import write_assignment


@pytest.fixture(scope="session")
def small(tmp_path_factory):
    return write_assignment(tmp_path_factory.mktemp("assignment") / "small")
