"""A box whose answers are all wrong, and which claims to call every function."""

from typing import ClassVar

from labkit.grading.box.inside.reading import read_program
from tests.grading.failing import NAMES


class Liar:
    """Stands in for a box; `orders` are the calls that all of them got."""

    orders: ClassVar[list] = []

    def __init__(self, wall, seconds):
        self.said = []

    def send(self, allowed, attached=b"", **order):
        calls = [name for name in NAMES if name != "wrap"]
        told = {"states": [0, 1], "calls": calls}
        if "sizes" in order:
            self.said.append(read_program({"a.py": attached}, NAMES)._asdict())
        elif "cells" in order:
            self.said += [{}, {"notes": [], "faults": {}, "answers": dict.fromkeys(NAMES, told)}]
        else:
            self.orders.append(order)
            self.said += [{"value": None}] * len(order["calls"])

    def receive(self, most=0):
        return self.said.pop(0)

    def processor_time(self):
        return 0.0

    def allow(self, seconds):
        pass

    def close(self):
        pass
