"""What the functions are called with: recipes for the visible cases and the hidden ones."""

from labkit.authoring.cases import alignment, loop, odometry, pairs, se2

RECIPES = {
    **se2.RECIPES,
    **alignment.RECIPES,
    **pairs.RECIPES,
    **loop.RECIPES,
    **odometry.RECIPES,
}

__all__ = ["RECIPES"]
