"""A worker without a jail, started anew for each submission: limits alone, on any system."""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import shutil
import signal
import sys
from typing import Any

from labkit.grading.sandbox.inside import walls
from labkit.grading.sandbox.inside.imports import StandIns, forget_labkit
from labkit.grading.sandbox.inside.worker import Worker

if sys.platform == "win32":
    import msvcrt


def main(order_text: str) -> None:
    """Serve one submission over what were standard input and output."""
    order: dict[str, Any] = json.loads(order_text)
    reading, writing = os.dup(0), os.dup(1)
    quiet = os.open(os.devnull, os.O_RDWR)
    for standard in (0, 1, 2):
        os.dup2(quiet, standard)
    if sys.platform == "win32":
        for descriptor in (reading, writing):
            msvcrt.setmode(descriptor, os.O_BINARY)
    limit(order)
    folder = os.getcwd()

    def leave(*_: object) -> None:
        shutil.rmtree(folder, ignore_errors=True)  # the grader may be gone
        os._exit(0)

    if sys.platform == "linux":
        signal.signal(signal.SIGTERM, leave)
        walls.prctl(walls.PR_SET_PDEATHSIG, signal.SIGTERM, "die with the grader")
    forget_labkit()
    sys.meta_path.insert(0, StandIns())
    try:
        Worker(reading, writing, order).serve()
    finally:
        leave()


def limit(order: dict[str, Any]) -> None:
    """Lower what limits this system knows and lets one lower."""
    try:
        resource = importlib.import_module("resource")
    except ImportError:  # Windows knows none
        return
    for name, most in {
        "RLIMIT_CPU": int(order["total_seconds"]) + 2,
        "RLIMIT_AS": order["address_space"] + order["memory"],
        "RLIMIT_FSIZE": order["file_bytes"],
        "RLIMIT_CORE": 1,  # as `labkit.grading.sandbox.inside.walls.NO_CORE`
    }.items():
        with contextlib.suppress(AttributeError, ValueError, OSError):
            resource.setrlimit(getattr(resource, name), (most, most))
