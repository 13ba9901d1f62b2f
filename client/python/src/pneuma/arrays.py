"""What stands for points and numbers: tuples, lists and numpy arrays alike."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import DTypeLike, NDArray

from pneuma.errors import PneumaError

Floats: TypeAlias = NDArray[np.float32] | NDArray[np.float64]

#: x, y, z
Vector: TypeAlias = Sequence[float] | NDArray[Any]
#: w, x, y, z of a quaternion
Rotation: TypeAlias = Sequence[float] | NDArray[Any]
#: (n, 3), a row a point
Points: TypeAlias = Sequence[Vector] | NDArray[Any]
#: (n,); an array of more dimensions counts row by row
Numbers: TypeAlias = Sequence[float] | NDArray[Any]


def floats(given: object, where: str, number: DTypeLike = np.float64) -> NDArray[np.float64]:
    """An array of what is given, itself where that is one. Raises PneumaError."""
    try:
        array: NDArray[np.float64] = np.asarray(given, number)
    except (TypeError, ValueError):
        raise PneumaError("INVALID_ARGUMENT", "are no numbers", where) from None
    return array
