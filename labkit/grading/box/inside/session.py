"""Runs one submission and answers calls of its functions, one JSON object a line.

The student's code shares this process and can forge every byte that leaves it. A forged answer is
a value like any other, compared outside with a reference that never came in.
"""

from __future__ import annotations

import ast
import builtins
import codeop
import contextlib
import json
import os
import random
import signal
import sys
import time
import traceback
import types
from collections import defaultdict
from collections.abc import Iterator
from typing import Any

import numpy as np

from labkit.grading.box.inside import confine, data, parsing, reading, standins
from labkit.grading.box.inside.calling import OutOfTime, call_function, limit_time
from labkit.grading.box.inside.lending import RightFunction, Slot, undefined
from labkit.grading.box.inside.limits import Time

NUMBERS = (np.ndarray, np.generic, float, int, str)  # hold no function


class Session:
    """One submission: its namespace, what each cell left behind, and the calls."""

    def __init__(self, writing: int) -> None:
        self.writing = writing  # the file descriptor of the answers
        module = sys.modules["__main__"] = types.ModuleType("__main__")
        self.space: dict[str, Any] = module.__dict__
        # By answer: after the last cell that defines it, and after the whole where it differs.
        self.states: dict[tuple[str, int], dict[str, Any]] = {}
        self.functions: list[str] = []
        self.answers: dict[str, Any] = {}  # the last definition of each function
        self.uses: dict[str, set[str]] = defaultdict(set)  # what a definition mentions, by its name
        self.finder = standins.Finder(self.run_script)
        self.compile = codeop.Compile()  # it remembers imports of __future__
        self.faults: dict[str, str] = {}  # why functions could not be parsed, by their names
        # Errors of the statements that would have bound a name: who misses it is told of them.
        self.causes: dict[str, BaseException] = {}
        self.lent: dict[str, RightFunction] = {}  # in place of the student's functions

    def tell(self, **answer: Any) -> None:
        """Write one line, whole."""
        os.write(self.writing, json.dumps(answer).encode("ascii") + b"\n")

    @contextlib.contextmanager
    def within(self, seconds: float) -> Iterator[None]:
        """Limit the processor time; what hears of no limit, in C, ends the box at twice as much."""
        signal.setitimer(signal.ITIMER_VIRTUAL, 2.0 * seconds + 1.0)
        try:
            with limit_time(seconds):
                yield
        finally:
            signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)

    def run_cells(
        self,
        seconds: float,
        cells: list[tuple[str, str]],
        scripts: dict[str, str],
        functions: list[str],
    ) -> None:
        """Run cells (source, label) in turn, and say what they define of the given functions."""
        self.functions = functions
        self.finder.scripts.update(scripts)
        notes = list[str]()
        spaces = dict[str, Any]()  # after the last cell that defines a function, by its name
        self.space.update({name: standins.StandIn(name) for name in ("display", "get_ipython")})
        self.space["np"] = np
        self.space |= {name: Slot(name, undefined(name), self.lent) for name in functions}
        time.sleep = lambda _: None  # who draws step by step waits for nobody here
        random.seed(0)  # graded again, a submission draws the same
        np.random.seed(0)  # noqa: NPY002
        time_left = Time(seconds)
        for place, (source, label) in enumerate(cells):
            self.tell(cell=place)
            earlier = dict(self.answers)
            fault = self.run_cell(source, label, time_left)
            notes += [fault] * bool(fault)
            for name, value in self.answers.items():
                if value is not earlier.get(name):
                    spaces[name] = self.space | self.answers
        final = self.space | self.answers
        answers = {name: self.describe(name, spaces[name], final) for name in self.answers}
        faults = {name: self.faults[name] for name in self.functions if name in self.faults}
        self.tell(notes=notes[:60], answers=answers, faults=faults)

    def run_cell(self, source: str, label: str, time_left: Time) -> str:
        """Run the statements of a cell one by one; why it was not run to its end."""
        try:
            with self.within(time_left.call):
                nodes, faults = parsing.statements(source, label)
        except BaseException as error:
            return f"{label} cannot be parsed, so nothing in it counts: {describe_error(error)}"
        self.faults |= faults
        fault = f"{next(iter(faults.values()))}: it is left out" if faults else ""
        for node in nodes:
            start = time.process_time()
            defines = parsing.is_definition(node)
            limit = time_left.call if defines else time_left.experiment()
            if isinstance(node, parsing.IMPORTS):
                limit = time_left.importing
            if not limit:
                continue
            try:
                with self.within(limit):
                    self.run(node, label)
            except BaseException as error:
                error = self.find_cause(error)
                reason = describe_error(error)
                fault = fault or f"{label} did not run to its end: {reason}"
                names = parsing.names_bound(node)
                self.faults |= {
                    name: f"its definition fails with {reason}"
                    for name in names
                    if name in self.functions
                }
                self.causes |= dict.fromkeys(names, error)
            if not defines:
                time_left.experiments -= time.process_time() - start
        return fault

    def run(self, node: ast.stmt, label: str) -> None:
        """Run one statement of a cell, and note what it defines.

        Stubs and labkit's own functions never replace an answer.
        """
        for name, value in self.define(node, label, self.space).items():
            is_stub = name in self.answers and parsing.is_stub(value)
            if name in self.functions and type(value) is Slot and not is_stub:
                self.answers[name] = value

    def define(self, node: ast.stmt, label: str, space: dict[str, Any]) -> dict[str, Any]:
        """Run a statement in a space, and note what it uses; its definitions but for numbers."""
        code = self.compile(ast.Module([node], []), label, "exec")  # type: ignore[arg-type]
        earlier = dict(space)
        defined = dict[str, Any]()
        try:
            exec(code, space)
        finally:
            for name, value in list(space.items()):
                if earlier.get(name) is not value and not isinstance(value, NUMBERS):
                    self.uses[name] |= parsing.names_in(code)
                    defined[name] = self.put_in_slot(name, value, space)
        return defined

    def put_in_slot(self, name: str, value: Any, space: dict[str, Any]) -> Any:
        """Put a function that is asked for into its slot, under all its names and in classes."""
        is_own = callable(value) and type(value) not in (standins.StandIn, Slot)
        if name not in self.functions or not is_own:
            return value
        space[name] = slot = Slot(name, value, self.lent)
        function = getattr(value, "__func__", value)  # of a method
        if getattr(function, "__globals__", None) is space:
            for other, holder in list(space.items()):
                if holder is value:
                    space[other] = slot
                    self.uses[other].add(name)
                for attribute, part in [*vars(holder).items()] if isinstance(holder, type) else []:
                    if getattr(part, "__func__", part) is function:
                        setattr(holder, attribute, Slot(name, part, self.lent))
                        self.uses[attribute].add(name)
        return slot

    def run_script(self, source: str, name: str, module: types.ModuleType) -> None:
        """Run a script as the module that imports it.

        A package that it imports and that is missing costs what uses it alone, as in a cell.
        """
        for node in parsing.statements(source, name)[0]:
            try:
                self.define(node, name, vars(module))
            except ModuleNotFoundError as error:
                self.causes |= dict.fromkeys(parsing.names_bound(node), error)

    def describe(
        self, name: str, defining: dict[str, Any], final: dict[str, Any]
    ) -> dict[str, Any]:
        """Keep the state after its last cell, and that at the end if it or what it uses differs.

        Returns the numbers of its states, and which of the given functions it calls.
        """
        used = [name]
        for function in used:  # which grows meanwhile
            used += self.uses[function].difference(used)
        spaces = [defining]
        if any(final.get(function) is not defining.get(function) for function in used):
            spaces.append(final)
        self.states |= {(name, place): space for place, space in enumerate(spaces)}
        calls = [function for function in self.functions if function in used[1:]]
        return {"states": [*range(len(spaces))], "calls": calls}

    def ask(
        self,
        function: str,
        state: int,
        *,
        lent: dict[str, str],
        in_form: list[str],
        calls: list[Any],
        seconds: float,
    ) -> None:
        """Call a function in one of its states, with right functions in place of some others.

        Those `in_form` answer in the form in which the student's own does.
        """
        self.space.clear()
        self.space.update(self.states.get((function, state), {}))
        self.lent.clear()
        for name, source in lent.items():
            namespace: dict[str, Any] = {}
            exec(source, namespace)
            self.lent[name] = RightFunction(namespace[name], asks_form=name in in_form)
        random.seed(0)
        np.random.seed(0)  # noqa: NPY002
        for arguments in calls:
            values = [data.from_json(argument) for argument in arguments]
            try:
                with self.within(seconds):
                    answer = call_function(self.call, [function, *values], find_place)
            except OutOfTime:  # the others would take as long
                self.tell(status="too long")
                break
            self.tell(**answer, is_writing=list(map(data.to_json, values)) != arguments)

    def call(self, function: str, *values: Any) -> Any:
        """Call a function by its name; where it misses a name, the cause is raised."""
        try:
            return self.space[function](*values)
        except NameError as error:
            raise self.find_cause(error) from None

    def find_cause(self, error: BaseException) -> BaseException:
        """The error that left a name unbound which this one misses; any other one as it is."""
        return self.causes.get(str(error.name), error) if type(error) is NameError else error


def describe_error(error: BaseException) -> str:
    """The error in a line, with the place in the student's code."""
    if isinstance(error, OutOfTime):
        return str(error)
    return data.describe_error(error) + find_place(error)


def find_place(error: BaseException) -> str:
    """The place of an error in the student's code."""
    for frame, line in traceback.walk_tb(error.__traceback__):
        file = frame.f_code.co_filename
        if not file.startswith(("/", "<")):
            return f" (line {line} of {file})"
    return ""


def main() -> None:
    """Close the box around this process, and serve."""
    orders = os.fdopen(os.dup(0), "rb")
    writing = os.dup(1)
    quiet = os.open(os.devnull, os.O_RDWR)
    for standard in (0, 1):
        os.dup2(quiet, standard)
    real = open
    # A box may make no file, so the null device, which `open(…, "w")` would make, is copied.
    vars(builtins)["open"] = lambda f, *a, **k: real(os.dup(1) if f == os.devnull else f, *a, **k)
    session = Session(writing)
    settings = json.loads(sys.argv[1])
    sys.setrecursionlimit(3 * sys.getrecursionlimit())  # a call through a slot takes three levels
    sys.meta_path.insert(0, session.finder)
    confine.confine(**settings)
    for name in [name for name in sys.modules if name.partition(".")[0] == "labkit"]:
        del sys.modules[name]  # out of reach of `import`
    with open(json.__file__, "rb"):
        session.tell(ready=True)  # and whoever one is now can read Python's own library
    os.dup2(quiet, 2)  # until here the grader reads what is wrong
    for order in map(json.loads, orders):
        if "sizes" in order:
            files = {name: orders.read(size) for name, size in order["sizes"].items()}
            program = reading.read_program(files, order["functions"], order["handed_out"])
            session.tell(**program._asdict())
        elif "cells" in order:
            session.run_cells(**order)
        else:
            session.ask(**order)
    os._exit(0)
