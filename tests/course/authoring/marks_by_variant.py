"""Marks by variant: ``python tests/course/authoring/marks_by_variant.py`` prints a table of them.

Each known mistake, in each of its ways, is judged by each variant's hidden cases. The last column
says what it would get if it had no name: the share of the cases that pass.
"""

import statistics

from labkit.course.authoring.compute import passing
from labkit.course.authoring.misconceptions import MISTAKES
from labkit.course.grading.assignment import load_assignment
from labkit.course.grading.contract import Outcome, OutcomeStatus
from labkit.course.grading.judging.compare import assess


def marks(assignment, one):
    """The points of the mistake's own question, for each way and variant that it comes out."""
    question = assignment.question(one.question)
    table = []
    for hidden in assignment.variants:
        cases = assignment.visible[question.id] + hidden[question.id]
        count = max(len(case.mistaken.get(one.id, ())) for case in cases)
        for way in range(count):
            outcomes = [
                Outcome(id=case.id, status=OutcomeStatus.RETURNED, value=case.mistaken[one.id][way])
                if one.id in case.mistaken
                else Outcome(id=case.id, status=OutcomeStatus.RAISED, error="ValueError")
                for case in cases
            ]
            table.append(assess(question, cases, outcomes).score)
    return table


def by_cases(assignment, one):
    """What the mistake would get by the share of the cases alone, were it not known."""
    question = assignment.question(one.question)
    shares = []
    for hidden in assignment.variants:
        cases = hidden[question.id]
        passed = sum((one.id, 0) in passing(question, case) for case in cases)
        shares.append(question.points * passed / len(cases))
    return shares


def main():
    assignment = load_assignment()
    rows = [(one, marks(assignment, one), by_cases(assignment, one)) for one in MISTAKES]
    print(
        "question            mistake                     points of   least   most  by cases alone"
    )
    for one, got, alone in rows:
        points = assignment.question(one.question).points
        print(
            f"{one.question:19} {one.id:27} {points:9g} {min(got):7.2f} {max(got):6.2f}"
            f"   {min(alone):5.2f} to {max(alone):5.2f}"
        )
    spread = [max(got) - min(got) for _, got, _ in rows]
    blind = [max(alone) - min(alone) for *_, alone in rows]
    print(f"{len(rows)} mistakes; widest difference {max(spread):.2f} points of 100;")
    print(f"by cases alone {max(blind):.2f}, {statistics.mean(blind):.2f} in the mean")


if __name__ == "__main__":
    main()
