"""Names for the types of arrays that every room uses."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Real numbers in double precision."""

ComplexArray = NDArray[np.complex128]
"""Complex numbers in double precision."""

Rows = tuple[tuple[Array, ...], ...]
"""A matrix of polynomials: one row for each output, one polynomial for each input."""
