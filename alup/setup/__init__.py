# SPDX-License-Identifier: GPL-2.0-or-later
"""Install the extension and make its private Python environment.

One installer for three doors: `install.sh`, `install.cmd` and the effect *Set up*.  In comes a machine
(`machine.py`); its Inkscape (`inkscapes.py`) and an interpreter that loads PyPI's wheels (`pythons.py`) are
found; the environment is made, tried and put in place (`environment.py`, `trial.py`); the files of the
extension are copied first where they are not there yet (`files.py`, `install.py`).  What goes wrong is a
sentence (`faults.py`).

Inkscape's own Python runs all of this, Python 3.8 included, so that only the standard library is imported.
"""
