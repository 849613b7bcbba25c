"""A whole class: the workers that grade it, and what is done when one is lost."""
