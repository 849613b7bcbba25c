"""Arguments of the functions: tables of the visible cases and of the hidden ones."""

from labkit.course.authoring.cases import alignment, correspondences, loop, odometry, se2

RECIPES = (
    se2.RECIPES | alignment.RECIPES | correspondences.RECIPES | loop.RECIPES | odometry.RECIPES
)
