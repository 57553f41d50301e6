"""The bearing elements of the time simulation."""

ELEMENTS = ("linear", "ball-by-ball")
"""The tangent stiffness at the operating point, or every ball by itself."""
