"""Modules that run in the box, beside the student's code; imports nothing else of labkit."""
