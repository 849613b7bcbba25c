"""Gradescope's ``results.json``, as its "Autograder specifications: output format" has it.

Stricter than Gradescope: a field that the specification does not know is refused.
"""

FORMAT = {"enum": ["text", "html", "simple_format", "md", "ansi"]}
VISIBILITY = {"enum": ["visible", "hidden", "after_due_date", "after_published"]}
NUMBER, STRING, OBJECT = {"type": "number"}, {"type": "string"}, {"type": "object"}

TEST = {
    "type": "object",
    "additionalProperties": False,
    "properties": {
        "score": NUMBER,
        "max_score": NUMBER,
        "status": {"enum": ["passed", "failed"]},
        "name": STRING,
        "name_format": FORMAT,
        "number": STRING,
        "output": STRING,
        "output_format": FORMAT,
        "tags": {"type": "array", "items": STRING},
        "visibility": VISIBILITY,
        "extra_data": OBJECT,
    },
    "dependentRequired": {"max_score": ["score"]},
}
LEADER = {
    "type": "object",
    "additionalProperties": False,
    "required": ["name", "value"],
    "properties": {"name": STRING, "value": {}, "order": {"enum": ["asc", "desc"]}},
}
RESULTS = {
    "type": "object",
    "additionalProperties": False,
    "properties": {
        "score": NUMBER,
        "execution_time": {"type": "number", "minimum": 0},
        "output": STRING,
        "output_format": FORMAT,
        "test_output_format": FORMAT,
        "test_name_format": FORMAT,
        "visibility": VISIBILITY,
        "stdout_visibility": VISIBILITY,
        "extra_data": OBJECT,
        "tests": {"type": "array", "items": TEST},
        "leaderboard": {"type": "array", "items": LEADER},
    },
    "anyOf": [  # the points stand above, or in one test at least
        {"required": ["score"]},
        {
            "required": ["tests"],
            "properties": {"tests": {"contains": {"required": ["score"]}}},
        },
    ],
}
