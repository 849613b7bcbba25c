"""Runs one submission and answers calls of its functions; nothing that it says is trusted.

The grader writes orders to standard input, one JSON object a line, and reads answers in the same
form. The student's code shares this process and can forge every byte that leaves it. A forged
answer is a value like any other, compared outside with a reference that never came in.
"""

from __future__ import annotations
import __future__

import ast
import base64
import builtins
import contextlib
import json
import os
import random
import re
import signal
import sys
import time
import traceback
import types
from collections.abc import Iterator
from typing import Any

import numpy as np

from labkit.course.grading.inside import confine, data, reading, standins

MAX_MESSAGE = 480
MAX_RESULT = 1 << 20
MODULE = "__main__"
DEFINITIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Import, ast.ImportFrom)
FUTURE = __future__.annotations.compiler_flag
RUNNING_MAGICS = ("time", "timeit", "capture", "prun", "python", "python3", "debug")


class OutOfTime(BaseException):
    """A cell or a call that is cut short."""


class Shell(standins.StandIn):
    """What `get_ipython()` gives: magics that run Python run it, all others do nothing."""

    def __init__(self, session: Session) -> None:
        super().__init__("get_ipython")
        object.__setattr__(self, "session", session)

    def run_line_magic(self, name: str, line: str, *_: Any, **__: Any) -> Any:
        """``%time statement`` and ``%run script.py``."""
        if name in ("time", "timeit", "prun"):
            self.session.run_source(line)
        elif name == "run":
            source = self.session.scripts.get(line.strip().strip("'\""), "")
            self.session.run_source(source)

    def run_cell_magic(self, name: str, line: str, body: str) -> Any:
        """``%%time``, ``%%capture`` and the like."""
        if name in RUNNING_MAGICS:
            self.session.run_source(body)
        elif name == "writefile":
            self.session.add_script(line.rsplit(maxsplit=1)[-1] if line.split() else "", body)

    def getoutput(self, *_: Any, **__: Any) -> list[str]:
        """No line: there is no shell."""
        return []


class Session:
    """One submission: its namespace, what each cell left behind, and the calls.

    Parameters
    ----------
    lines : iterator of bytes
        The grader's orders.
    writing : int
        The file descriptor of the answers.
    """

    def __init__(self, lines: Iterator[bytes], writing: int) -> None:
        self.lines = lines
        self.writing = writing
        module = sys.modules[MODULE] = types.ModuleType(MODULE)
        self.space: dict[str, Any] = module.__dict__
        self.states: dict[tuple[str, str], dict[str, Any]] = {}
        self.answers: dict[str, Any] = {}  # the last definition of each function
        self.owner: dict[str, int] = {}  # the cell that it stands in
        self.hands_on: dict[str, str] = {}
        self.labels: set[str] = set()
        self.scripts: dict[str, str] = {}
        self.functions: list[str] = []
        self.cell = -1
        self.future = 0
        self.armed = False
        self.transform = reading.load_transformer()

    def serve(self) -> None:
        """Follow orders until there are no more."""
        for name in (signal.SIGALRM, signal.SIGPROF):
            signal.signal(name, self.cut)
        for line in self.lines:
            order = json.loads(line)
            if "files" in order:
                self.read(**order)
            else:
                self.ask(**order)

    def tell(self, **answer: Any) -> None:
        """Write one line, whole."""
        line = json.dumps(answer).encode("ascii") + b"\n"
        while line:
            line = line[os.write(self.writing, line) :]

    def cut(self, *_: Any) -> None:
        """End what takes too long; again and again, since code may catch it."""
        if self.armed:
            raise OutOfTime

    @contextlib.contextmanager
    def within(self, seconds: float) -> Iterator[None]:
        """Limit the processor time, and the time by the clock to twice as much."""
        self.armed = True
        signal.setitimer(signal.ITIMER_PROF, seconds, 0.1)
        signal.setitimer(signal.ITIMER_REAL, 2.0 * seconds, 0.1)
        try:
            yield
        finally:
            self.armed = False
            signal.setitimer(signal.ITIMER_PROF, 0.0)
            signal.setitimer(signal.ITIMER_REAL, 0.0)

    def read(
        self, files: dict[str, str], functions: list[str], seconds: float, skipped: list[int]
    ) -> None:
        """Run the notebook from top to bottom, and say what it defines."""
        notes: list[str] = []
        self.functions = functions
        contents = {name: base64.b64decode(text) for name, text in files.items()}
        cells, self.scripts = reading.programs(contents, functions, notes)
        sys.meta_path.insert(0, standins.Finder(self.scripts))
        self.begin()
        broken: dict[str, str] = {}
        left = 2.0 * seconds  # for all experiments together
        for place, cell in enumerate(cells):
            if place in skipped:
                notes.append(f"{cell.label} ended the program or hung, so it is left out")
                continue
            self.tell(cell=place)
            start, self.cell = time.process_time(), place
            fault = self.run_cell(cell, min(seconds, left) if left > 0 else seconds, left <= 0)
            left -= time.process_time() - start
            if fault:
                notes.append(fault)
                broken |= {
                    name: fault
                    for name in functions
                    if re.search(rf"^[ \t]*def[ \t]+{name}\b", cell.source, re.MULTILINE)
                }
            self.keep(place)
        self.states |= {("end", name): self.patched() for name in self.answers}
        self.tell(
            notes=notes[:60],
            answers=self.described(),
            broken=broken,
        )

    def begin(self) -> None:
        """Fill the namespace as a notebook has it; `np` is there even if its import is gone."""
        random.seed(0)  # graded again, a submission draws the same
        np.random.seed(0)  # noqa: NPY002
        shell = Shell(self)
        self.space.update(np=np, get_ipython=lambda: shell, display=standins.StandIn("display"))

    def run_cell(self, cell: reading.Cell, seconds: float, definitions_only: bool) -> str:
        """Run the statements of a cell one by one; why it was not run to its end."""
        self.labels.add(cell.label)
        nodes: list[ast.stmt] = []
        faults: list[str] = []
        try:
            with self.within(seconds):
                nodes = reading.statements(cell, self.transform)
        except BaseException as error:
            return f"{cell.label} is no Python, so nothing in it counts: {self.text(error)}"
        for node in nodes:
            if definitions_only and not is_definition(node):
                continue
            try:
                with self.within(seconds):
                    self.run_node(node, cell.label)
            except BaseException as error:
                faults.append(f"{cell.label} did not run to its end: {self.text(error)}")
                definitions_only = not cell.is_script or isinstance(error, OutOfTime)
            self.note_answers()
        return faults[0] if faults else ""

    def run_node(self, node: ast.stmt, label: str) -> None:
        """Run one statement, by what the submission imports of `__future__` so far."""
        code = compile(ast.Module([node], []), label, "exec", self.future, dont_inherit=True)
        exec(code, self.space)
        if isinstance(node, ast.ImportFrom) and node.module == "__future__":
            self.future |= code.co_flags & FUTURE
        if isinstance(node, ast.FunctionDef):
            self.hands_on[node.name] = handed_on(node)

    def run_source(self, source: str) -> None:
        """Run what a magic holds, as part of the cell that it stands in."""
        cell = reading.Cell(source, "a magic")
        self.labels.add(cell.label)
        for node in reading.statements(cell, self.transform):
            self.run_node(node, cell.label)
            self.note_answers()

    def add_script(self, name: str, text: str) -> None:
        """Make a script that a cell writes one to import."""
        self.scripts[name] = text
        sys.meta_path[0] = standins.Finder(self.scripts)

    def note_answers(self) -> None:
        """Note each function that was defined anew; a stub or an import from labkit hides none."""
        for name in self.functions:
            value = self.space.get(name)
            if not callable(value) or isinstance(value, standins.StandIn):
                continue
            known = self.answers.get(name)
            if value is not known and (known is None or is_stub(known) or not is_stub(value)):
                self.answers[name], self.owner[name] = value, self.cell

    def keep(self, place: int) -> None:
        """Keep what a cell left behind, for the functions that it defines."""
        for name, owner in self.owner.items():
            if owner == place:
                self.states["own", name] = self.patched()

    def patched(self) -> dict[str, Any]:
        """The namespace, with each answer in its place although a number took its name."""
        return self.space | self.answers

    def described(self) -> dict[str, Any]:
        """Say of each answer what it calls, and whether something it uses was changed later."""
        found = {}
        for name in self.answers:
            own, end = self.states["own", name], self.states["end", name]
            names = reached(own[name], own, set())
            found[name] = {
                "changes": any(own.get(one) is not end.get(one) for one in names),
                "calls": [one for one in self.functions if one in names and one != name],
                "hands_on": self.hands_on.get(name, ""),
            }
        return found

    def ask(
        self, function: str, state: str, right: dict[str, str], calls: list[Any], seconds: float
    ) -> None:
        """Call a function in one of its states, with right functions in place of some others."""
        space = self.states.get((state, function), {})
        self.space.clear()
        self.space.update(space)
        changed = [(where, dict(where)) for where in spaces_of(space.get(function), self.space)]
        for name, source in right.items():
            defined: dict[str, Any] = {}
            exec(source, defined)
            self.space[name] = defined[name]
            for where, _ in changed:
                where.update({name: defined[name]} if name in where else {})
        random.seed(0)
        np.random.seed(0)  # noqa: NPY002
        end = time.process_time() + seconds
        for place, arguments in enumerate(calls):
            self.tell(call=place, **self.call(function, arguments, end - time.process_time()))
        for where, before in changed:
            where.update(before)

    def call(  # noqa: PLR0911 (one for each way to end)
        self, function: str, arguments: list[Any], seconds: float
    ) -> dict[str, Any]:
        """One call, and how it ended."""
        if not callable(self.space.get(function)):
            return {"status": "NOT_DEFINED"}
        if seconds <= 0:
            return {"status": "TIMEOUT"}
        try:
            given = [data.from_json(argument) for argument in arguments]
            with self.within(seconds):
                value = data.to_json(data.plain(self.space[function](*given), MAX_RESULT))
            return {"status": "RETURNED", "value": value}
        except data.NotDataError as error:
            return {"status": "NOT_DATA", "message": str(error)[:MAX_MESSAGE]}
        except data.TooMuchError as error:
            return {"status": "TOO_LARGE", "message": str(error)[:MAX_MESSAGE]}
        except OutOfTime:
            return {"status": "TIMEOUT"}
        except BaseException as error:
            kind = type(error)
            name = str(getattr(kind, "__name__", ""))[:60]
            own = name if getattr(builtins, name, None) is kind else ""
            return {"status": "RAISED", "error": own, "message": self.text(error)}

    def text(self, error: BaseException) -> str:
        """The error in a line, with the place in the student's code."""
        if isinstance(error, OutOfTime):
            return "it took too long, and was cut short"
        name, text = "an error", ""
        with contextlib.suppress(BaseException):  # it may raise another one when looked at
            name = str(type(error).__name__)[:60]
            text = str(error)[:MAX_MESSAGE]
        place = ""
        if not isinstance(error, SyntaxError):
            for frame, line in traceback.walk_tb(error.__traceback__):
                label = frame.f_code.co_filename
                if label in self.labels or label in self.scripts:
                    place = f" (line {line} of {label})"
        return f"{name}: {text}"[:MAX_MESSAGE] + place


def is_definition(node: ast.stmt) -> bool:
    """Whether a statement defines or imports something, or sets a constant: it calls nothing."""
    constant = isinstance(node, ast.Assign | ast.AnnAssign) and not any(
        isinstance(part, ast.Call | ast.comprehension) for part in ast.walk(node)
    )
    return constant or isinstance(node, DEFINITIONS)


def is_stub(value: Any) -> bool:
    """Whether a function does nothing but raise `NotImplementedError`, as it was handed out."""
    code = getattr(value, "__code__", None)
    return code is not None and code.co_names == ("NotImplementedError",)


def codes_of(value: Any, depth: int = 0) -> list[types.CodeType]:
    """The code of a function, a method, a class or a partial, with that of functions in it."""
    if isinstance(value, type):
        return [code for part in vars(value).values() for code in codes_of(part, depth + 1)]
    for name in ("__wrapped__", "__func__", "func", "pyfunc"):
        inner = getattr(value, name, None) if depth < 5 else None
        if callable(inner):
            return codes_of(inner, depth + 1)
    code = getattr(value, "__code__", None)
    found: list[types.CodeType] = []
    open_codes = [code] if isinstance(code, types.CodeType) else []
    while open_codes and len(found) < 500:
        found.append(one := open_codes.pop())
        open_codes += [part for part in one.co_consts if isinstance(part, types.CodeType)]
    return found


def reached(value: Any, space: dict[str, Any], names: set[str]) -> set[str]:
    """All global names that a function uses, and that what it calls uses."""
    fresh = {name for code in codes_of(value) for name in code.co_names} - names
    names |= fresh
    own = getattr(value, "__globals__", space)
    for name in fresh:
        below = own.get(name, space.get(name))
        if isinstance(below, types.FunctionType | type) and len(names) < 2000:
            reached(below, space, names)
    return names


def spaces_of(value: Any, space: dict[str, Any]) -> list[dict[str, Any]]:
    """The namespaces of the scripts that a function comes from, or calls functions of."""
    names = reached(value, space, set())
    values = [value, *(space.get(name) for name in names)]
    found = [getattr(one, "__globals__", None) for one in values]
    return [one for one in found if isinstance(one, dict) and "__builtins__" in one]


def handed_on(node: ast.stmt) -> str:
    """The function to which a definition hands all its work: ``return f(...)`` and no more."""
    body = [line for line in getattr(node, "body", []) if not is_text(line)]
    value = body[0].value if len(body) == 1 and isinstance(body[0], ast.Return) else None
    called = value.func if isinstance(value, ast.Call) else None
    return called.id if isinstance(called, ast.Name) else ""


def is_text(line: ast.stmt) -> bool:
    """Whether a statement is a docstring or the like."""
    return isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant)


def main() -> None:
    """Close the box around this process, and serve."""
    settings = json.loads(sys.argv[1])
    reading_end, writing = os.dup(0), os.dup(1)
    quiet = os.open(os.devnull, os.O_RDWR)
    for standard in (0, 1):
        os.dup2(quiet, standard)
    session = Session(iter(os.fdopen(reading_end, "rb")), writing)
    confine.confine(**settings)
    standins.forget_labkit()
    session.tell(ready=True)
    os.dup2(quiet, 2)  # until here the grader reads what is wrong
    session.serve()
    os._exit(0)
