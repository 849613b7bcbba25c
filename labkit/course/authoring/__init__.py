"""Writing the assignment: questions, cases, right answers and known wrong ones.

``python -m labkit.course.authoring`` computes all of it afresh and writes the files that
`labkit.course.grading.assignment` reads and the notebook that students get. This side knows the
answers, so nothing of grading or of the notebooks imports it, and students do not get it.

`questions/` holds the texts, points and limits, in TOML; `sections/` what each function is called
with, and its known mistakes; `solution` the right functions. Instructors edit these three.
"""
