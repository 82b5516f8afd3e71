# SPDX-License-Identifier: GPL-2.0-or-later
"""One thread for numpy's libraries, if this is imported before numpy.

Times are then those of the work alone, for both sides of a comparison.  Runs in forks need it, too, because
threads do not survive a fork.  Processes that are started inherit it.
"""

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"
