"""Slips: the solution with one step gone wrong, a pool to hold the visible cases to.

They are made from its source, one node of the syntax tree at a time, and so hold for every
question: a sign, two factors that are exchanged, a root that is forgotten, `<` for `<=`.
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
TAKEN_FOR = {
    "+": "-", "-": "+", "*": "/", "/": "*", "<": "<= >", "<=": "< >", ">": ">= <", ">=": "> <",
    "min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "argmin": "argmax",
    "argmax": "argmin", "mean": "sum median max", "median": "mean max min", "sum": "mean max",
    "sin": "cos", "cos": "sin", "int": "round",
}  # fmt: skip


def slips(source: str) -> Iterator[str]:
    """Each slip in the last function of a source, as the source with it."""
    code = source.encode()  # in which a node's columns count
    lines = [0, *accumulate(map(len, code.splitlines(keepends=True)))]
    for node in ast.walk(ast.parse(source).body[-1]):
        if isinstance(node, ast.expr):
            before = code[: lines[node.lineno - 1] + node.col_offset].decode()
            after = code[lines[(node.end_lineno or 0) - 1] + (node.end_col_offset or 0) :].decode()
            for wrong in _slips_at(node):
                yield f"{before}({wrong}){after}"


def _slips_at(node: ast.expr) -> Iterator[str]:
    """Nodes that may stand in place of a node."""
    match node:
        case ast.BinOp(one, sign, other) | ast.Compare(one, [sign], [other]) if type(sign) in SIGNS:
            yield from _of_signs(node, SIGNS[type(sign)], text(one), text(other))
        case ast.Call(function):
            yield from _of_calls(node, text(function))
        case ast.UnaryOp():
            yield text(node.operand)
        case ast.Attribute(matrix, "T"):
            yield text(matrix)
        case ast.Tuple([one, other], ast.Load()):
            yield f"{text(other)}, {text(one)}"
        case ast.Constant(int() | float() as number):
            yield f"{number - 1}"
            yield f"{number + 1}"


def _of_signs(node: ast.expr, sign: str, one: str, other: str) -> Iterator[str]:
    for taken in TAKEN_FOR.get(sign, "").split():
        yield f"({one}) {taken} ({other})"
    if isinstance(node, ast.BinOp):
        yield f"({other}) {sign} ({one})"
        yield one
        yield other


def _of_calls(call: ast.Call, called: str) -> Iterator[str]:
    of, _, name = called.rpartition(".")
    for taken in TAKEN_FOR.get(name, "").split():
        yield called.removesuffix(name) + taken + text(call).removeprefix(called)
    yield from map(text, call.args) if call.args else (of,)
    if len(call.args) == 2:
        yield text(ast.Call(call.func, call.args[::-1], call.keywords))
    for word in call.keywords:
        rest = [each for each in call.keywords if each is not word]
        yield text(ast.Call(call.func, call.args, rest))
