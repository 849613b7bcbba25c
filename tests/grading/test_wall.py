"""A wall that cannot be opened is told as missing, with its reason, and leaves nothing open."""

import os
import sys
from pathlib import Path

import pytest

from labkit.grading.box import outside
from labkit.grading.box.outside import Box, Wall, why_not
from labkit.grading.box.watch import MachineError

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="walls are Linux's")

# What stands in the wall's place: its mode, its text, and the reason that is told.
REFUSED = "bwrap: No permissions to create new namespace"
PROGRAMS = {
    "not found": (None, "", "No such file or directory: 'bwrap'"),
    "not executable": (0o644, "#!/bin/sh\n", "Permission denied: 'bwrap'"),
    "not a program": (0o755, "\0", "Exec format error: 'bwrap'"),
    "killed at once": (
        0o755,
        "#!/bin/sh\nkill -9 $$\n",
        "the box did not start: the program ended",
    ),
    "ends at once": (0o755, "#!/bin/sh\n", "the box did not start: the program ended"),
    "a namespace refused": (0o755, f"#!/bin/sh\necho '{REFUSED}' >&2\nexit 1\n", REFUSED),
}


def files_and_processes():
    """Open files of this process, and processes that it started."""
    started = Path(f"/proc/self/task/{os.getpid()}/children").read_text()
    return os.listdir("/proc/self/fd"), started.split()


@pytest.fixture(params=PROGRAMS)
def reason(request, tmp_path, monkeypatch):
    """Put a program in the wall's place; the reason for which it opens no wall."""
    mode, text, reason = PROGRAMS[request.param]
    if mode is not None:
        program = tmp_path / "bwrap"
        program.write_text(text)
        program.chmod(mode)
    monkeypatch.setitem(outside.ENVIRONMENT, "PATH", str(tmp_path))
    return reason


def test_a_wall_that_does_not_open_is_missing_for_a_reason(reason):
    assert reason in why_not(Wall(mode="bubblewrap"))


def test_a_wall_that_does_not_open_leaves_nothing_open(reason):
    before = files_and_processes()

    with pytest.raises(MachineError) as raised:
        Box(Wall(mode="bubblewrap"))

    assert files_and_processes() == before, raised  # its frames hold what the box has opened
