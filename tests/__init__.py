"""A package, so that `from tests.folder.module import ...` finds this folder and no other."""
