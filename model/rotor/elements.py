"""The bearing elements of the time simulation, and what else a hammer test can be computed with."""

LINEAR, BALLS = "linear", "ball-by-ball"
ELEMENTS = (LINEAR, BALLS)
"""The tangent stiffness at the operating point, or every ball by itself."""

REDUCED = "reduced"
HAMMER = (*ELEMENTS, REDUCED)
"""Of a hammer test: also the linear spindle by its reduced model, stepped exactly and without MuJoCo."""
