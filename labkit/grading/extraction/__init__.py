"""What of a submission is an answer: notebooks and scripts in, cells for the sandbox out."""

from labkit.grading.extraction.extract import Extraction, extract

__all__ = ["Extraction", "extract"]
