# SPDX-License-Identifier: GPL-2.0-or-later
"""The types of arrays: by what they hold, where a record says so, else `Array`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

Array = np.ndarray

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Ints = NDArray[np.integer[Any]]
    Bools = NDArray[np.bool_]
    Complexes = NDArray[np.complex128]
else:  # a run does without numpy's module of types
    Floats = Ints = Bools = Complexes = np.ndarray
