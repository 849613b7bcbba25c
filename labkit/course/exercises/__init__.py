"""Checks for the exercises of the chapters: they try a function and name the mistake.

In a chapter an exercise with code is one cell with the tag ``stub``, below its text::

    def turn_about(c, theta):
        '''Transform (3, 3) that turns the plane by `theta` [rad] about the point `c` (2,).'''
        raise NotImplementedError  # your code here


    check(turn_about)

The stub keeps quiet as long as nothing is written, so the chapter runs from end to end. The
solution stands below it, in cells with the tag ``solution``, and ends in the same call of
`check`; the students' edition takes these cells away and keeps the stub. What follows and needs
the function stands below ``if check(turn_about).passed:``.

**To add an exercise**, write the cases of the function in the module of its chapter's topic here
(a new module is found by itself)::

    @exercise("Turn about a point")
    def turn_about() -> Iterator[Case]:
        theta, c = 0.7, np.array([2.0, -1.0])
        yield Case(
            "a turn by 0.7 rad about (2, −1)",
            (c, theta),
            right=...,
            mistakes={"This turns about the origin: bring `c` there first.": rotated},
        )

The generator has the name of the function that it checks; `check` finds it by that name, which is
unique in the book. `right` and each mistake are *values*: a number, an array, or a tuple of them.
Write `right` by another way than the solution where there is one. A mistake that happens to be
right in a case is left out there. Sentences in ``mistakes`` say what was done and why it is wrong.
The text of the exercise carries stars and minutes, and a hint that unfolds::

    :::{exercise} Turn about a point · ★☆☆ · 10 min
    :label: ex-se2-pivot

    ... the question ...

    ```{dropdown} Hint
    ...
    ```
    :::

``tests/course/exercises`` then holds that the empty stub does not pass, that the notebook's
solution does, that every mistake is called by its name, and that stubs and cases match one to one.
"""

from labkit.course.exercises.check import check
from labkit.course.exercises.exercise import Case, Exercise, exercise, exercises

__all__ = ["Case", "Exercise", "check", "exercise", "exercises"]
