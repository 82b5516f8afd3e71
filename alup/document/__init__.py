"""SVG <-> Drawing; the only part of the package that knows inkex.

Between two answers of a drag `outlines` has path data to draw.

Reading walks the selected objects into their groups, takes every shape as path data, and applies all
transforms, so that the other stages see root user units.  Writing goes back: each changed element
gets new path data in its own coordinates; nothing else of it changes.  An element none of whose
points moved is not touched.

What belongs to the shapes follows them: clip paths and masks (`companions`), gradients and patterns
in user space (`paints`), texts and images (`carried`); `changes` holds it all back until nothing can fail.

Files are read with care, and written whole or not at all (`loading`, `effect`).
Nothing is lost: a run stores what the elements were, and later runs start from that (`store`).
"""

from .effect import Effect
from .notes import tell
from .outlines import Outlines
from .places import original_points
from .reading import Document, read, refuse_unknown
from .restoring import forget, restore
from .seams import held as hold_seams
from .writing import write

__all__ = [
    "Document",
    "Effect",
    "Outlines",
    "forget",
    "hold_seams",
    "original_points",
    "read",
    "refuse_unknown",
    "restore",
    "tell",
    "write",
]
