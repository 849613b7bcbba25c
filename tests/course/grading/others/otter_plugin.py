"""An otter plugin: otter-grader is the harness, the points are those of labkit's results.json."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from otter.plugins import AbstractOtterPlugin


class LabkitScores(AbstractOtterPlugin):
    """Grades the submission once more, in isolation, and puts those scores in the place."""

    def during_generate(self, otter_config, assignment):
        """Nothing is to be added to the archive."""

    def before_grading(self, config):
        """The configuration stays."""

    def before_execution(self, submission):
        """The submission stays."""
        return submission

    def after_grading(self, results):
        """Have ``labkit grade`` write Gradescope's file, and take the scores from it."""
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "results.json")
            command = [sys.executable, "-m", "labkit", "grade", self.submission_path]
            command += ["--student", self.plugin_config["student"], "--jobs", "1", "--no-html"]
            command += ["--out", folder, "--gradescope", file, *self.plugin_config["options"]]
            subprocess.run(command, check=True, capture_output=True)
            graded = json.loads(file.read_text(encoding="utf-8"))
        for test in graded["tests"]:
            if "score" in test:
                results.update_score(test["tags"][0], test["score"])
        results.set_output(graded["output"])

    def generate_report(self):
        """What otter prints besides."""
        return "scores by labkit"
