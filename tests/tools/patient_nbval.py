"""A plugin of pytest by which nbval waits for a cell as long as its kernel lives.

nbval gives a kernel 60 seconds to start, 10 for its first answer and 30 for its first output, and
a cell 5 for its last output: on a busy machine a clock would decide whether a notebook is right.

    pytest -p tests.tools.patient_nbval --nbval-lax --nbval-current-env notebooks/03*.ipynb
"""

from queue import Empty
from typing import Any

import pytest
from nbval.kernel import RunningKernel
from nbval.plugin import IPyNbCell

WEEK = 7 * 24 * 3600.0  # [s]
LOOK = 1.0  # [s] between two looks at whether the kernel lives
wait_for_reply = RunningKernel.await_reply


def await_reply(self: RunningKernel, msg_id: str, timeout: float | None = None) -> Any:
    """Wait for the reply to a message; raises `Empty` once the kernel is dead."""
    while True:
        try:
            return wait_for_reply(self, msg_id, timeout=LOOK)
        except Empty:
            if not self.is_alive():
                raise


def ensure_iopub_up(self: RunningKernel) -> None:
    """Ask the kernel until its outputs arrive; raises `Empty` once the kernel is dead."""
    while True:
        request = self.kc.kernel_info()
        self.await_reply(request)
        try:
            self.await_idle(request, LOOK)
        except Empty:
            if not self.is_alive():
                raise
        else:
            return


def pytest_configure(config: pytest.Config) -> None:
    """Let nbval wait for replies and for a kernel's start."""
    RunningKernel.await_reply = await_reply
    RunningKernel._ensure_iopub_up = ensure_iopub_up
    config.option.nbval_kernel_startup_timeout = WEEK


def pytest_itemcollected(item: pytest.Item) -> None:
    """Let nbval wait for a cell's last output."""
    if isinstance(item, IPyNbCell):
        item.output_timeout = WEEK
