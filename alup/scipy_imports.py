# SPDX-License-Identifier: GPL-2.0-or-later
"""Import scipy without what no run uses, which took a third of a second of every start.

Of `scipy.sparse.csgraph` and `scipy.spatial` a run uses two searches, a tree and a triangulation.  Their
packages import all of scipy.linalg, scipy.special and rotations in space besides, for functions that they
only hand on.  And scipy's layer of array interfaces reads every name of numpy, so that numpy imports the
front end of its Fortran compiler and its tests.

`prepare` puts stand-ins there while the packages are imported, and takes them away afterwards.  What was
handed on is imported when it is called.  Where a scipy is laid out otherwise its packages are imported as
they are.
"""

from __future__ import annotations

import importlib
import os
import sys
import types
from typing import Callable, Dict, List

# What numpy would import when it is asked for the name.
_OF_NUMPY = ("f2py", "testing", "random", "polynomial", "ma", "ctypeslib")

# What is wanted, and what is handed on by these packages; none of them uses it when it is imported.
_PACKAGES = ("scipy.sparse.csgraph", "scipy.spatial")
_HANDED_ON = (
    "scipy._lib._docscrape",
    "scipy.sparse.csgraph._laplacian",
    "scipy.spatial._geometric_slerp",
    "scipy.spatial._procrustes",
    "scipy.spatial.distance",
    "scipy.spatial.transform",
)

# A package of which a module is used, but not what the package itself imports.
_ONLY_A_FOLDER = "scipy.linalg"


class _Later(types.ModuleType):
    """A module that is imported when something in it is called, or used after `prepare`."""

    preparing = False

    def __getattr__(self, name: str) -> object:
        if name.startswith("__"):
            raise AttributeError(name)
        return _handed_on(self.__name__, name) if self.preparing else getattr(_module(self.__name__), name)


class _NoText(Dict[str, List[str]]):
    """A text that says nothing in any section: scipy 1.17 reads these, 1.18 adds to them."""

    def __missing__(self, section: str) -> list[str]:
        return self.setdefault(section, [])

    def __str__(self) -> str:
        return "signature\n"


def _asked(name: str, numpy: types.ModuleType) -> Callable[[object], bool]:
    """A question about an array that may be masked; one of numpy's own kinds is not."""

    def answer(x: object) -> bool:
        plain = type(x) is numpy.ndarray or isinstance(x, numpy.generic)
        return not plain and bool(getattr(_module("numpy.ma"), name)(x))

    return answer


def _module(name: str) -> types.ModuleType:
    """A module itself, not what stands for it."""
    if isinstance(sys.modules.get(name), _Later):
        del sys.modules[name]
    return importlib.import_module(name)


def _handed_on(module: str, name: str) -> object:
    """What imports the function it stands for when it is called; a class, as which it serves in types too."""

    def called(_cls: type, *arguments: object, **named: object) -> object:
        if name == "FunctionDoc" and _Later.preparing:
            return _NoText()  # scipy rewrites some texts while it is imported
        return getattr(_module(module), name)(*arguments, **named)

    return type(name, (), {"__new__": called})


def prepare() -> None:
    """Import what runs need of scipy, if it is not there yet."""
    if "scipy.sparse" in sys.modules or "scipy.spatial" in sys.modules:
        return
    numpy, scipy = importlib.import_module("numpy"), importlib.import_module("scipy")
    later = [_Later(f"numpy.{name}") for name in _OF_NUMPY if name not in vars(numpy)]
    for module in later:
        setattr(numpy, module.__name__.partition(".")[2], module)
        if module.__name__ == "numpy.ma":
            # What `numpy.unique` and `numpy.median` ask of every array.
            for name in ("is_masked", "isMaskedArray"):
                vars(module)[name] = _asked(name, numpy)
    _Later.preparing = True
    before = set(sys.modules)
    standing = [_Later(name) for name in (*_HANDED_ON, _ONLY_A_FOLDER) if name not in sys.modules]
    for module in standing:
        sys.modules[module.__name__] = module
        if module.__name__ == _ONLY_A_FOLDER:
            module.__path__ = [os.path.join(folder, "linalg") for folder in scipy.__path__]
    try:
        # OpenBLAS takes its buffer at the first use, and ends the process where it gets none: the drawing,
        # whose size is anybody's, comes after.
        numpy.linalg.inv(numpy.eye(1))
        for name in _PACKAGES:
            importlib.import_module(name)
    except (
        ImportError,
        AttributeError,
        TypeError,
        ValueError,
        LookupError,
    ):  # another scipy: imported anew, which says what is wrong
        for name in set(sys.modules) - before:
            if name.startswith("scipy."):
                del sys.modules[name]
    _Later.preparing = False
    for module in (*later, *standing):
        if sys.modules.get(module.__name__) is module:
            del sys.modules[module.__name__]
