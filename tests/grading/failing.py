"""Functions that fail, each in some way, for laws that hold for all of them."""

from labkit.course.assignment import load_assignment

ASSIGNMENT = load_assignment()
NAMES = [one.function for one in ASSIGNMENT.questions]


# How a function fails: its body, or with a leading line break what stands before its definition.
WAYS = {
    "endless loop": "while True:\n        pass",
    "endless recursion": "return {name}(*given)",
    "exit": "__import__('os')._exit(0)",
    "segmentation fault": "__import__('ctypes').string_at(0)",
    "too much memory": "held = [bytes(2**27) for _ in range(99)]",
    "exception at its definition": "\n1 / 0\n",
    "syntax error in its own cell": "return (",
    "None": "return None",
    "wrong answer": "return np.full(7, 0.125)",
}


def failing(name, way):
    """The cell of a function that fails in some way."""
    before, body = (WAYS[way], "pass") if WAYS[way].startswith("\n") else ("", WAYS[way])
    return f"{before}def {name}(*given):\n    {body.format(name=name)}\n"


def parameters(name):
    return ASSIGNMENT.question(name).signature.strip("()").split(", ")
