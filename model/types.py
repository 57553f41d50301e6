"""Array types that signatures name: double precision and indices, shapes told in docstrings."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Integers = NDArray[np.intp]
