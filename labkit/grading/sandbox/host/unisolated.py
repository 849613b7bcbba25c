"""Mode "none": a Python of its own for each submission, held by limits and nothing else."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time

from labkit.grading.contract import Limits
from labkit.grading.sandbox.host import launch
from labkit.grading.sandbox.host.box import Exit, SandboxError, order
from labkit.grading.sandbox.host.channel import Channel, GoneError, LateError, PipeChannel, receive
from labkit.grading.sandbox.inside.data import WireError

MOMENT = 1.0  # s
START = 60.0  # s that a busy machine may take to import numpy
SMALL = 1 << 16
LIBRARIES = 1 << 30  # bytes of address space that Python and numpy are granted


class ColdBox:
    """A running Python without a jail."""

    def __init__(self, limits: Limits) -> None:
        self.folder = tempfile.mkdtemp(prefix="labkit-")
        told = json.dumps(order("none", limits, address_space=LIBRARIES))
        self.process = subprocess.Popen(
            launch.command("unisolated", told),
            env=launch.environment() | {"HOME": self.folder},
            cwd=self.folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            bufsize=0,
            start_new_session=True,
        )
        self.channel: Channel = PipeChannel(self.process)

    def stop(self, leaving: bool) -> Exit:
        """Kill it, its process group and its folder."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(MOMENT if leaving else 0)
        ended = self.process.poll()
        with contextlib.suppress(ProcessLookupError, PermissionError):
            if os.name == "posix":
                os.killpg(self.process.pid, signal.SIGKILL)
            else:
                self.process.kill()
        self.process.wait()
        self.channel.close()
        shutil.rmtree(self.folder, ignore_errors=True)
        return Exit(signal=-ended if ended is not None and ended < 0 else 0)


class ColdStarter:
    """Starts boxes of mode "none"."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits

    def start(self, *, scipy: bool) -> ColdBox:
        """A fresh process, that has numpy imported.

        Raises
        ------
        SandboxError
            If Python does not start.
        """
        box = ColdBox(self.limits)
        try:
            receive(box.channel, SMALL, time.monotonic() + START)
        except (LateError, GoneError, WireError):
            raise SandboxError(f"mode none does not work here: {box.stop(leaving=True)}") from None
        return box

    def close(self) -> None:
        """Nothing outlives its box."""
