"""Array types shared by all rooms."""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]
IntArray: TypeAlias = npt.NDArray[np.intp]
BoolArray: TypeAlias = npt.NDArray[np.bool_]

GRAVITY_MPS2 = 9.80665
"""Standard gravity. [m/s2]"""
