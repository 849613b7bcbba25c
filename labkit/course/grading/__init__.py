"""Autograding: answers run in a box that knows no solution, and are judged outside it."""
