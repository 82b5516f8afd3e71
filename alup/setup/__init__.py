# SPDX-License-Identifier: GPL-2.0-or-later
"""Install the extension and make its private Python environment.

One installer serves `install.sh`, `install.cmd` and the effect *Set up*. In comes a machine (`machine.py`).
Its Inkscape (`inkscapes.py`) and an interpreter that loads PyPI's wheels (`pythons.py`) are found. The
environment is planned (`environment_plan.py`, `packages.py`), made, tried and put in place (`environment.py`,
`trial.py`). Before that the extension's files are copied, where they are not there yet (`files.py`,
`install.py`). Errors become sentences with a remedy (`faults.py`).

Inkscape's own Python runs all of this, Python 3.8 included, so that only the standard library is imported.
"""
