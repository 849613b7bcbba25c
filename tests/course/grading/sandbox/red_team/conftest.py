"""The red team's field: a slot of each mode that works here, and what must stay untouched."""

import os
import secrets
import shutil
import socket
import tempfile
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import pytest

import labkit
from labkit.course.grading.contract import Limits
from labkit.course.grading.sandbox.host import MODES, SandboxError, open_sandbox
from labkit.course.grading.sandbox.host.modes import NONE

PATIENCE = {False: 5.0, True: 0.5}  # s a question: for attacks that end, and that do not


@dataclass(frozen=True, kw_only=True)
class Bait:
    """What an attack is pointed at: files, variables and a server of the grader."""

    secret: str
    file: Path
    server: socket.socket

    def aim(self, source):
        """Put the bait's addresses into an attack."""
        for word, value in {
            "@CANARY_FILE@": str(self.file),
            "@LABKIT@": str(Path(labkit.__file__).parent),
            "@GRADER@": str(os.getpid()),
            "@PORT@": str(self.server.getsockname()[1]),
        }.items():
            source = source.replace(word, value)
        return source

    def state(self):
        """All that an attack might have changed."""
        about = self.file.stat()
        try:
            self.server.accept()
        except BlockingIOError:
            called = False
        else:
            called = True
        return (
            self.file.read_text(),
            sorted(os.listdir(self.file.parent)),
            (about.st_mode, about.st_mtime_ns, about.st_uid, about.st_nlink),
            dict(os.environ),
            (os.getcwd(), os.getpriority(os.PRIO_PROCESS, 0), os.sched_getaffinity(0)),
            called,
        )


def pytest_collection_modifyitems(items):
    """Ask of mode none what it promises alone: it limits, it does not isolate."""
    items[:] = [item for item in items if promised(getattr(item, "callspec", None))]


def promised(callspec):
    params = callspec.params if callspec else {}
    return params.get("slots") != NONE or params.get("attack", {}).get("holds", True)


@pytest.fixture(scope="session")
def bait():
    """Readable by everybody, so that only the sandbox stands in the way."""
    secret = f"CANARY_SECRET_{secrets.token_hex(8)}"
    folder = Path(tempfile.mkdtemp(prefix="grader-"))
    folder.chmod(0o755)
    file = folder / "references.json"
    file.write_text(secret)
    file.chmod(0o644)
    os.environ["LABKIT_CANARY"] = secret
    server = socket.create_server(("127.0.0.1", 0))
    server.setblocking(False)
    yield Bait(secret=secret, file=file, server=server)
    server.close()
    del os.environ["LABKIT_CANARY"]
    shutil.rmtree(folder)


@pytest.fixture(scope="session", params=MODES)
def slots(request, bait):
    """Slots of one mode by whether the attack hangs; skips where the mode does not work."""
    with ExitStack() as stack:
        try:
            yield {
                hangs: stack.enter_context(
                    open_sandbox(
                        request.param,
                        Limits(seconds=seconds, memory=256 << 20, result_bytes=1 << 20),
                    )
                )
                for hangs, seconds in PATIENCE.items()
            }
        except SandboxError as why:  # it says what to install
            pytest.skip(str(why))
