# SPDX-License-Identifier: GPL-2.0-or-later
"""As-Locally-Uniform-As-Possible reshaping of vector clip-art.

The package knows curves, handles and energies; it does not know Inkscape (only
`alup.document` imports inkex).  `alup.session.pipeline.reshape` is the way in.
"""

__version__ = "0.2.0"
