"""The first page's map is of today's code."""

import shutil
from pathlib import Path

import pytest
from killian_map import fingerprint

import labkit

PACKAGE = Path(labkit.__file__).parent
MODULES = sorted(path.relative_to(PACKAGE) for path in PACKAGE.rglob("*.py"))


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    return Path(shutil.copytree(PACKAGE, tmp_path_factory.mktemp("map") / "labkit"))


@pytest.mark.parametrize("room", sorted({path.parts[0] for path in MODULES}))
def test_a_change_anywhere_in_labkit_draws_the_map_anew(copy, room):
    module = copy / next(path for path in MODULES if path.parts[0] == room)
    before = fingerprint(copy)

    module.write_text(module.read_text("utf-8") + "# changed\n", "utf-8")

    assert fingerprint(copy) != before
