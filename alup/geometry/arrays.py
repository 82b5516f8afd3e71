# SPDX-License-Identifier: GPL-2.0-or-later
"""The type of all arrays of the package."""

from __future__ import annotations

import numpy as np

Array = np.ndarray
