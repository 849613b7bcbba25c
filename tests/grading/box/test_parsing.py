"""A fault costs the function in which it stands, and is told by its line."""

import ast

import pytest

from labkit.grading.box.inside.parsing import statements

FAULTY = {  # a function whose fourth line is no Python
    "a signature of many lines": "def f(\n    x,\n):\n    return (x\n",
    "a decorator": "@wraps\ndef f(x):\n    y = x\n    return (y\n",
    "a line of its own": "def f(x):\n    y = [\n        x]\n    return y y\n",
}


@pytest.mark.parametrize("kind", FAULTY)
def test_what_is_no_python_costs_its_function_and_is_told_by_its_line(kind):
    source = f"{FAULTY[kind]}\n\ndef g(x):\n    return x\n"

    nodes, faults = statements(source, "cell 7")

    assert [node.name for node in nodes] == ["g"]
    assert next(iter(faults)) == "f"  # which the page tells
    assert faults["f"].startswith("line 4 of cell 7 is no Python")


MIXED = """%matplotlib inline
x = 1

def f(x):
    return x

y = = 2

def g(x):
    return x
"""


def test_statements_keep_their_lines_beside_magics_and_faults():
    nodes, _ = statements(MIXED, "cell 1")

    lines = MIXED.splitlines()
    found = {node.name: lines[node.lineno - 1] for node in nodes if hasattr(node, "name")}
    assert found == {"f": "def f(x):", "g": "def g(x):"}


WHOLE = [  # statements with lines that are not indented
    "if x:\n    y = 1\n# or else\nelif z:\n    y = 2\nelse:\n    y = 3\n",
    "try:\n    y = 1\nexcept E:\n    y = 2\nfinally:\n    y = 3\n",
    "y = [\n    1,\n]\n",
    "@one\n@two(\n    1\n)\ndef f(\n    x,\n):\n    return x\n",
]


@pytest.mark.parametrize("statement", WHOLE)
def test_a_statement_of_many_parts_stays_whole_beside_a_fault(statement):
    nodes, _ = statements(f"y = = 1\n{statement}y = = 2\n", "cell 1")

    assert list(map(ast.unparse, nodes)) == [ast.unparse(ast.parse(statement))]
