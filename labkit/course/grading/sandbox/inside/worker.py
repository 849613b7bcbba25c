"""Runs a submission's cells and calls, and sends data about them; nothing it sends is trusted.

The student's code shares this process and can forge every byte that leaves it. A forged
frame gains what it says and no more: a value that is compared with a reference that never
entered the box. Whether the process hung, died or talked out of turn is judged outside.

The zygote closes a jail and then has a `Worker` serve in it; `main` serves without a jail.
"""

from __future__ import annotations

import ast
import builtins
import contextlib
import importlib
import io
import json
import os
import random
import shutil
import signal
import sys
import time
import types
from typing import Any

import numpy as np

from labkit.course.grading.extraction.extract import extract
from labkit.course.grading.sandbox.inside import data, walls
from labkit.course.grading.sandbox.inside.imports import Library, StandIn, StandIns, forget_labkit

if sys.platform == "win32":
    import msvcrt

MAX_MESSAGE = 480
MODULE = "submission"
POSIX = hasattr(signal, "getitimer")


class Closed(Exception):
    """The grader has nothing more to ask."""


class Worker:
    """Serves one submission over a pair of file descriptors."""

    def __init__(self, reading: int, writing: int, order: dict[str, Any]) -> None:
        self.reading = reading
        self.writing = writing
        self.order = order
        self.namespace: dict[str, Any] = {}
        self.labels: set[str] = set()
        self.own = Library({})  # the scripts of the submission
        self.left = 0

    def serve(self) -> None:
        """Say that the jail is closed, run the cells, then calls until there are no more."""
        module = types.ModuleType(MODULE)
        sys.modules[MODULE] = sys.modules["__main__"] = module
        self.namespace = module.__dict__
        random.seed(0)  # graded again, a submission draws the same
        np.random.seed(0)  # noqa: NPY002
        self.namespace.update(
            get_ipython=lambda: StandIn("get_ipython"), display=StandIn("display")
        )
        sys.meta_path.insert(0, self.own)
        self.send({"ready": True})
        try:
            asked = self.receive()
            if "files" in asked:
                self.send(found_in(**asked))
                asked = self.receive()
            for place, cell in enumerate(asked["cells"]):
                self.send({"cell": place, **self.run_cell(**cell)})
            while True:
                self.left = self.order["result_bytes"]
                asked = self.receive()
                for call in [self.receive() for _ in range(asked["calls"])]:
                    self.send({"turn": asked["turn"], **self.run_call(**call)})
                if leaves_something():
                    return  # the next question begins in a process of its own
        except Closed:
            return

    def run_cell(
        self, source: str, label: str, modules: tuple[str, ...], reduced: bool
    ) -> dict[str, Any]:
        """Run one cell, or have it imported; what it prints is nobody's business."""
        self.labels.add(label)
        if modules:
            self.own.carry(source, label, modules)
            return {}
        sys.stdout = sys.stderr = Printed(0)
        try:
            code = compile(definitions(source) if reduced else source, label, "exec")
            exec(code, self.namespace)
        except BaseException as error:
            return self.account(error)
        return {}

    def run_call(
        self, id: str, function: str, arguments: tuple[Any, ...], keywords: dict[str, Any]
    ) -> dict[str, Any]:
        """Run one call and describe how it ended; what is empty is left out."""
        answer: dict[str, Any] = {"id": id}
        printed = sys.stdout = sys.stderr = Printed(self.order["output_chars"])
        start = time.perf_counter()
        try:
            value = self.namespace[function]
        except KeyError:
            return answer | {"status": "NOT_DEFINED", "seconds": 0.0}
        try:
            value = data.plain(value(*arguments, **keywords), self.left)
            answer |= {"status": "RETURNED", "value": value}
        except data.NotDataError as error:
            answer |= {"status": "NOT_DATA", "message": str(error)}
        except data.TooMuchError as error:
            answer |= {"status": "TOO_LARGE", "message": str(error)}
        except BaseException as error:
            answer |= {"status": "RAISED", **self.account(error)}
        answer["seconds"] = time.perf_counter() - start
        if printed.text:
            answer["output"] = printed.text
        return answer

    def account(self, error: BaseException) -> dict[str, str]:
        """The error's built-in name, and its message with the place in the student's code."""
        kind = type(error)
        name, text = "an error", ""
        with contextlib.suppress(BaseException):  # it may raise another one when looked at
            name = str(kind.__name__)[:60]
            text = str(error)[:MAX_MESSAGE]
        place = self.place(error)
        return {
            "error": name if getattr(builtins, name, None) is kind else "",
            "message": f"{name}: {text}"[:MAX_MESSAGE] + (f" ({place})" if place else ""),
        }

    def place(self, error: BaseException) -> str:
        """The last line of the student's code that the error went through."""
        if isinstance(error, SyntaxError) and error.filename in self.labels:
            return f"line {error.lineno} of {error.filename}"
        found = ""
        trace = error.__traceback__
        while trace is not None:
            label = trace.tb_frame.f_code.co_filename
            if label in self.labels:
                found = f"line {trace.tb_lineno} of {label}"
            trace = trace.tb_next
        return found

    def send(self, message: dict[str, Any]) -> None:
        """Write one frame."""
        try:
            frame = data.pack(message)
        except data.TooLargeError as error:
            message |= {"status": "TOO_LARGE", "value": None, "message": f"returned: {error}"}
            frame = data.pack(message)
        self.left -= len(frame)
        view = memoryview(frame)
        while view:
            view = view[os.write(self.writing, view) :]

    def receive(self) -> Any:
        """Read one frame."""
        return data.receive(self.read, data.MAX_REQUEST, data.MAX_REQUEST)[0]

    def read(self, count: int) -> bytes:
        """Read exactly so many bytes."""
        parts = []
        while count:
            part = os.read(self.reading, min(count, 1 << 20))
            if not part:
                raise Closed
            parts.append(part)
            count -= len(part)
        return b"".join(parts)


def found_in(files: dict[str, Any], functions: dict[str, str]) -> dict[str, Any]:
    """What of a submission's files is an answer, as data: no code of theirs has run yet."""
    found = extract({name: data.to_bytes(held) for name, held in files.items()}, functions)
    return {
        "sources": tuple(
            data.from_bytes(one.source.encode("utf-8", "replace")) for one in found.cells
        ),
        "questions": tuple(one.question for one in found.cells),
        "labels": tuple(one.label for one in found.cells),
        "modules": tuple(one.modules for one in found.cells),
        "notes": found.notes,
        "unread": found.unread,
        "passages": np.array(found.passages, dtype="<i8"),
    }


def leaves_something() -> bool:
    """Whether a question left what could hang the next one: a thread, a timer, a trace.

    Code that means to can hide it; then it hangs its own next question.
    """
    if sys.gettrace() or sys.getprofile() or len(sys._current_frames()) > 1:
        return True
    timers = (signal.ITIMER_REAL, signal.ITIMER_VIRTUAL, signal.ITIMER_PROF) if POSIX else ()
    return any(signal.getitimer(timer)[0] for timer in timers)


class Printed(io.TextIOBase):
    """Takes what is printed and keeps the beginning."""

    def __init__(self, most: int) -> None:
        self.most = most
        self.text = ""

    def write(self, text: str) -> int:
        """Keep what still fits."""
        if len(self.text) < self.most:
            self.text = "".join((self.text, text))[: self.most]  # and no method of `text`
        return len(text)

    def writable(self) -> bool:
        """True."""
        return True


DEFINITIONS = (
    ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Import, ast.ImportFrom,
)  # fmt: skip


def definitions(source: str) -> str:
    r"""Keep imports, functions, classes and assignments that call nothing.

    Examples
    --------
    >>> print(definitions("k = 2\ndef f(x):\n    return k * x\nwhile True: f(1)"))
    k = 2
    <BLANKLINE>
    def f(x):
        return k * x
    """
    tree = ast.parse(source)
    kept = [node for node in tree.body if isinstance(node, DEFINITIONS) or _is_constant(node)]
    return ast.unparse(ast.Module(kept, []))


def _is_constant(node: ast.stmt) -> bool:
    if not isinstance(node, (ast.Assign, ast.AnnAssign)):
        return False
    quiet = (ast.Call, ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp, ast.Await)
    return not any(isinstance(part, quiet) for part in ast.walk(node))


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
        "RLIMIT_CORE": 1,  # as `labkit.course.grading.sandbox.inside.walls.NO_CORE`
    }.items():
        with contextlib.suppress(AttributeError, ValueError, OSError):
            resource.setrlimit(getattr(resource, name), (most, most))
