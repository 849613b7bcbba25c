"""Reading of code without running it: its statements, what they define and what they mention."""

from __future__ import annotations

import ast
import re
import sys
import types
import warnings
from typing import Any

ESCAPED = r"(?:%%?[A-Za-z]|!(?!=))"  # and no remainder or inequality on a line of its own
MAGICS = {  # of IPython, in turn: those that run code leave it, others nothing
    r"\A\s*%%(?!time\b|capture|prun)(?s:.*)": "",
    r"^([ \t]*)%(?:time|prun) +": r"\1",
    r"^([ \t]*)%pylab\b.*": r"\1from pylab import *",
    r"^([ \t]*)%run +(?:\./)?(\w+).*": r"\1from \2 import *",
    rf"^([^#'\"\n]*=)[ \t]*{ESCAPED}.*": r"\1 None",
    rf"^([ \t]*)(?:{ESCAPED}.*|\?.*|[\w.]+\?+[ \t]*$)": r"\1pass",
}
# A line that is not indented begins a statement, but for these.
PIECE = re.compile(r"^(?=[^\s)\]}#])(?!(?:elif|else|except|finally)\b)", re.MULTILINE)
DEFINED = re.compile(r"^(?:async +)?def +(\w+)", re.MULTILINE)
VERSION = f"{sys.version_info.major}.{sys.version_info.minor}"
DEFINITIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
IMPORTS = (ast.Import, ast.ImportFrom)


def statements(source: str, label: str) -> tuple[list[ast.stmt], dict[str, str]]:
    """The statements of a cell, and the faults of what is no Python and left out.

    A fault stands under the name of the function that it leaves undefined, or under "".
    """
    nodes = list[ast.stmt]()
    faults = dict[str, str]()
    with warnings.catch_warnings(action="ignore"):
        try:
            nodes = ast.parse(source, label).body
        except SyntaxError:
            for magic, code in MAGICS.items():
                source = re.sub(magic, code, source, flags=re.MULTILINE)
            line = 0
            part = ""
            for piece in PIECE.split(source):
                part += piece
                if piece.startswith("@"):  # a decorator belongs to what follows
                    continue
                count = part.count("\n")
                try:
                    body = ast.parse(part, label).body
                    nodes += [ast.increment_lineno(node, line) for node in body]
                except SyntaxError as error:
                    named = DEFINED.search(part)
                    bad_line = line + min(error.lineno or 1, count + 1)
                    fault = f"line {bad_line} of {label} is no Python {VERSION} ({error.msg})"
                    faults.setdefault(named[1] if named else "", fault)
                line += count
                part = ""
    return nodes, faults


def is_definition(node: ast.stmt) -> bool:
    """True if a statement defines or imports something, or sets a constant: it calls nothing."""
    calls = any(isinstance(part, ast.Call | ast.comprehension) for part in ast.walk(node))
    constants = () if calls else (ast.Assign, ast.AnnAssign)
    return isinstance(node, (*DEFINITIONS, *IMPORTS, *constants))


def names_bound(node: ast.stmt) -> list[str]:
    """The names that an import, a definition or an assignment binds at its top."""
    if isinstance(node, IMPORTS):
        return [alias.asname or alias.name.partition(".")[0] for alias in node.names]
    if isinstance(node, DEFINITIONS):
        return [node.name]
    stored = (part for part in ast.walk(node) if isinstance(part, ast.Name))
    is_assignment = isinstance(node, ast.Assign | ast.AnnAssign)
    return [part.id for part in stored if is_assignment and isinstance(part.ctx, ast.Store)]


def is_stub(value: Any) -> bool:
    """True if a function does nothing but raise `NotImplementedError`, as it was handed out."""
    code = getattr(value, "__code__", None)
    return code is not None and code.co_names == ("NotImplementedError",)


def names_in(code: types.CodeType) -> set[str]:
    """The names that code mentions but for its own, with those of the code inside it."""
    inside = (names_in(part) for part in code.co_consts if isinstance(part, types.CodeType))
    return set(code.co_names).union(*inside)
