"""Slips: the right function with one step gone wrong, and the words for it.

They are made from its source, one node of the syntax tree at a time, and so hold for every
exercise: a sign, two factors that are exchanged, a root that is forgotten, `<` for `<=`.
"""

from __future__ import annotations

import ast
from ast import unparse as text
from collections.abc import Iterator
from itertools import accumulate

SIGNS: dict[type[ast.AST], str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.MatMult: "@", ast.Pow: "**",
    ast.BitAnd: "&", ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==",
}  # fmt: skip
PARTS = {"+": "term", "-": "term", "*": "factor", "@": "factor", "/": "divisor", "**": "power"}
TAKEN_FOR = {
    "+": "-", "-": "+", "*": "/", "/": "*", "<": "<= >", "<=": "< >", ">": ">= <", ">=": "> <",
    "min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "argmin": "argmax",
    "argmax": "argmin", "mean": "sum median max", "median": "mean max min", "sum": "mean max",
    "sin": "cos", "cos": "sin", "int": "round",
}  # fmt: skip


def slips(source: str) -> Iterator[tuple[str, str]]:
    """Each slip in the last function of a source: what it is, and the source with it."""
    code = source.encode()  # in which a node's columns count
    lines = [0, *accumulate(map(len, code.splitlines(keepends=True)))]
    for node in ast.walk(ast.parse(source).body[-1]):
        if isinstance(node, ast.expr):
            before = code[: lines[node.lineno - 1] + node.col_offset].decode()
            after = code[lines[(node.end_lineno or 0) - 1] + (node.end_col_offset or 0) :].decode()
            for says, wrong in _slips_at(node):
                yield says, f"{before}({wrong}){after}"


def _slips_at(node: ast.expr) -> Iterator[tuple[str, str]]:
    """Each slip at a node: what it is, and what stands there with it."""
    match node:
        case ast.BinOp(one, sign, other) | ast.Compare(one, [sign], [other]) if type(sign) in SIGNS:
            yield from _of_signs(node, SIGNS[type(sign)], text(one), text(other))
        case ast.Call(function):
            yield from _of_calls(node, text(function))
        case ast.UnaryOp():
            yield "a sign is left out", text(node.operand)
        case ast.Attribute(matrix, "T"):
            yield "a `.T` is left out", text(matrix)
        case ast.Tuple([one, other], ast.Load()):
            yield "two values of a pair are exchanged", f"{text(other)}, {text(one)}"
        case ast.Constant(int() | float() as number):
            for near in number - 1, number + 1:
                yield f"`{near:g}` stands where `{number:g}` belongs", f"{near}"


def _of_signs(node: ast.expr, sign: str, one: str, other: str) -> Iterator[tuple[str, str]]:
    for taken in TAKEN_FOR.get(sign, "").split():
        yield f"`{taken}` stands where `{sign}` belongs", f"({one}) {taken} ({other})"
    if isinstance(node, ast.BinOp):
        yield f"the two sides of a `{sign}` are exchanged", f"({other}) {sign} ({one})"
        for part in one, other:
            yield f"a {PARTS.get(sign, 'condition')} is left out", part


def _of_calls(call: ast.Call, called: str) -> Iterator[tuple[str, str]]:
    of, _, name = called.rpartition(".")
    for taken in TAKEN_FOR.get(name, "").split():
        wrong = called.removesuffix(name) + taken + text(call).removeprefix(called)
        yield f"`{taken}` stands where `{name}` belongs", wrong
    for part in map(text, call.args) if call.args else (of,):
        yield f"`{name}` is left out", part
    if len(call.args) == 2:
        exchanged = text(ast.Call(call.func, call.args[::-1], call.keywords))
        yield f"the arguments of `{name}` are exchanged", exchanged
    for word in call.keywords:
        rest = [each for each in call.keywords if each is not word]
        yield f"`{word.arg}` is left out", text(ast.Call(call.func, call.args, rest))
