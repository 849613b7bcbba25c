"""All that a sandbox holds: it needs the standard library and numpy, and nothing of labkit."""
