"""Writing the assignment: questions, cases, right answers and known wrong ones.

``python -m labkit.course.authoring`` computes all of it afresh and writes the files that
`labkit.course.assignment` reads and the notebook that students get. This side knows the
answers, so nothing of grading or of the notebooks imports it, and students do not get it.

`questions/` is what instructors edit: each question stands there with all that belongs to it, its
text, stub and solution, its cases, its known mistakes, and an oracle that the solution is held to.
"""
