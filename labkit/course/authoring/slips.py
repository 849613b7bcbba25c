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
            head = code[: lines[node.lineno - 1] + node.col_offset].decode()
            tail = code[lines[(node.end_lineno or 0) - 1] + (node.end_col_offset or 0) :].decode()
            for slip in _slips_at(node):
                yield f"{head}({slip}){tail}"


def _slips_at(node: ast.expr) -> Iterator[str]:
    """Nodes that may stand in place of a node."""
    match node:
        case ast.BinOp(left_side, sign, right_side) | ast.Compare(
            left_side, [sign], [right_side]
        ) if type(sign) in SIGNS:
            yield from _of_signs(node, SIGNS[type(sign)], text(left_side), text(right_side))
        case ast.Call(function):
            yield from _of_calls(node, text(function))
        case ast.UnaryOp():
            yield text(node.operand)
        case ast.Attribute(matrix, "T"):
            yield text(matrix)
        case ast.Tuple([left_side, right_side], ast.Load()):
            yield f"{text(right_side)}, {text(left_side)}"
        case ast.Constant(int() | float() as number):
            yield f"{number - 1}"
            yield f"{number + 1}"


def _of_signs(node: ast.expr, sign: str, left_side: str, right_side: str) -> Iterator[str]:
    for taken in TAKEN_FOR.get(sign, "").split():
        yield f"({left_side}) {taken} ({right_side})"
    if isinstance(node, ast.BinOp):
        yield f"({right_side}) {sign} ({left_side})"
        yield left_side
        yield right_side


def _of_calls(call: ast.Call, called: str) -> Iterator[str]:
    of, _, name = called.rpartition(".")
    for taken in TAKEN_FOR.get(name, "").split():
        yield called.removesuffix(name) + taken + text(call).removeprefix(called)
    yield from map(text, call.args) if call.args else (of,)
    if len(call.args) == 2:
        yield text(ast.Call(call.func, call.args[::-1], call.keywords))
    for word in call.keywords:
        rest = [keyword for keyword in call.keywords if keyword is not word]
        yield text(ast.Call(call.func, call.args, rest))
