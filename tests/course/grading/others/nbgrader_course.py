"""A course as nbgrader keeps it, graded by nbgrader; runs in nbgrader's own environment.

``python nbgrader_course.py FOLDER`` makes the release of ``source/lab1``, grades what is in
``submitted`` and prints the score of each student and question as JSON.
"""

import json
import os
import sys

from nbgrader.api import Gradebook
from nbgrader.apps import NbGraderAPI
from traitlets.config import Config

ASSIGNMENT = "lab1"


def main(folder):
    os.chdir(folder)
    config = Config()
    config.CourseDirectory.course_id = "scan_matching"
    config.CourseDirectory.root = folder
    config.ExecutePreprocessor.timeout = 120
    api = NbGraderAPI(config=config)
    if not os.path.isdir("submitted"):
        check(api.generate_assignment(ASSIGNMENT))
        return
    for student in sorted(os.listdir("submitted")):
        check(api.autograde(ASSIGNMENT, student))
    with Gradebook(f"sqlite:///{folder}/gradebook.db") as gradebook:
        scores = {}
        for submission in gradebook.assignment_submissions(ASSIGNMENT):
            grades = (grade for notebook in submission.notebooks for grade in notebook.grades)
            scores[submission.student.id] = {
                grade.name.removeprefix("check-").replace("-", "_"): grade.auto_score
                for grade in grades
            }
    print(json.dumps(scores))


def check(result):
    if not result["success"]:
        sys.exit(result.get("log") or result.get("error"))


main(sys.argv[1])
