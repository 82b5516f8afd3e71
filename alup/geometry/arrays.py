# SPDX-License-Identifier: GPL-2.0-or-later
"""Types of arrays: by their dtype in the records that name one, `Array` elsewhere."""

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
else:  # numpy.typing is not imported at run time
    Floats = Ints = Bools = Complexes = np.ndarray
