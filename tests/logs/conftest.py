"""Tiny logs, built line by line."""

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def flaser():
    """A function that writes an FLASER line."""

    def line(ranges, laser=(0.0, 0.0, 0.0), robot=None, ipc=1.0, logger=2.0):
        numbers = [*ranges, *laser, *(laser if robot is None else robot), ipc]
        return f"FLASER {len(ranges)} {' '.join(map(str, numbers))} host {logger}\n"

    return line


@pytest.fixture(scope="session")
def robotlaser():
    """A function that writes a ROBOTLASER1 line of one-degree beams from −90°."""

    def line(ranges, laser=(0.0, 0.0, 0.0), robot=None, maximum=50.0, stamp=1.0, remissions=()):
        head = [0, -1.570796, len(ranges) * 0.017453, 0.017453, maximum, 0.1, 0]
        poses = [*laser, *(laser if robot is None else robot)]
        beams = [len(ranges), *ranges, len(remissions), *remissions]
        numbers = [*head, *beams, *poses, 0, 0, 0, 0, 0, stamp]
        return f"ROBOTLASER1 {' '.join(map(str, numbers))} host 2.0\n"

    return line


@pytest.fixture(scope="session")
def run(flaser):
    """A good CARMEN log of five scans, after lines of other first words, which nobody reads."""
    others = "# a run\nPARAM a 1\nNEFF 3\nRAWLASER1 mud\n\nTRUEPOS 1 2\nSYNC x\nODOM 1 2 3 4\n"
    return others + "".join(
        flaser([1.0 + k, 2.0, 3.0, 4.0], (0.5 * k, 0.0, 0.1 * k), ipc=100.0 + k) for k in range(5)
    )


@pytest.fixture(scope="session")
def scratch(tmp_path_factory) -> Path:
    """A file that a property test may overwrite in every example."""
    return tmp_path_factory.mktemp("scratch") / "scratch.log"


@pytest.fixture
def save(tmp_path):
    """A function that writes text or bytes to a file and returns its path."""

    def write(content, name="run.log"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write
