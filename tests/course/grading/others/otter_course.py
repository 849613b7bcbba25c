"""A class graded by otter-grader's harness without containers; runs in otter's environment.

``python otter_course.py FOLDER`` packs ``tests/`` and ``otter_config.json`` with ``otter
generate``, grades every notebook below ``submitted`` as ``otter run`` does, leaves
``results/STUDENT.json`` and prints the score of each student and question as JSON.
"""

import json
import os
import shutil
import sys
from pathlib import Path

import otter.generate
import otter.run


def main(folder):
    os.chdir(folder)
    sys.path.insert(0, os.getcwd())  # where a plugin may lie
    otter.generate.main(no_environment=True, no_requirements=True)
    scores = {}
    with otter.run.capture_run_output():
        for notebook in sorted(Path("submitted").rglob("*.ipynb")):
            student = notebook.relative_to("submitted").parts[0]
            results = Path("results") / student
            results.mkdir(parents=True, exist_ok=True)
            graded = otter.run.main(str(notebook), output_dir=str(results), no_logo=True)
            shutil.move(results / "results.json", f"results/{student}.json")
            results.rmdir()
            scores[student] = {name: graded.get_score(name) for name in graded.test_files}
    print(json.dumps(scores))


main(sys.argv[1])
