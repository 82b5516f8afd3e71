# SPDX-License-Identifier: GPL-2.0-or-later
"""From a document to what *Done* leaves of it: engine, server and browser put together."""

from __future__ import annotations

from typing import Any, Sequence

import numpy as np

from ..messages.errors import DocumentError
from ..messages.language import translate as _
from ..model import Array
from ..session.options import HOLD_TOGETHER, METHODS, Options
from . import server as serving
from . import visits
from .browser import Browser
from .engine import Engine, SupersededError
from .server import Server
from .words import words


def reshape(svg: Any, selected: Sequence[Any], options: Options) -> Any:
    """Show a document until *Done* or its end; the tree that is to be written, or None for none.

    Raises DocumentError or HandleError as a run does, DocumentError where no window can be opened.
    """
    engine = Engine(svg, selected, options)
    server = Server(answers(engine))
    try:
        with Browser(server.address) as browser:
            ended = server.wait(browser.may_come)
        tree = engine.result() if ended == serving.DONE else None
    finally:
        server.close()
        engine.close()
    if ended == serving.NEVER:
        raise DocumentError(
            _(
                "No browser has opened the window; nothing was changed. Install Chromium, Chrome or Edge, or "
                "use Place handles and Reshape."
            )
        )
    visits.note()
    return tree


def answers(engine: Engine) -> dict[str, serving.Answer]:
    """What a page may ask."""

    def everything(_question: dict) -> dict[str, Any]:
        return {**engine.drawing(), **engine.state(), "words": words(), "first": visits.is_first()}

    def near(question: dict) -> Any:
        return engine.near(_point(question["at"]), _size(question["reach"]))

    def press(question: dict) -> dict[str, Any]:
        name = engine.press(_point(question["at"]), _size(question["reach"]))
        return {**engine.state(), "name": name}

    def add_frame(question: dict) -> dict[str, Any]:
        one, other = _point(question["from"]), _point(question["to"])
        name = engine.add_frame(np.minimum(one, other), np.maximum(one, other))
        return {**engine.state(), "name": name}

    def drag(question: dict) -> dict[str, Any]:
        return engine.drag(str(question["name"]), _points(question["to"]))

    def prepare(_question: dict) -> dict[str, Any]:
        engine.prepare()
        return {}

    def remove(question: dict) -> dict[str, Any]:
        engine.remove([str(name) for name in question["names"]])
        return engine.state()

    def undo(_question: dict) -> dict[str, Any]:
        engine.undo()
        return engine.state()

    def redo(_question: dict) -> dict[str, Any]:
        engine.redo()
        return engine.state()

    def choose(question: dict) -> dict[str, Any]:
        hold, method = str(question["hold"]), str(question["method"])
        if hold not in HOLD_TOGETHER or method not in METHODS:
            raise ValueError(hold, method)
        engine.choose(hold, method, question["symmetric"] is True)
        return engine.state()

    def answer(_question: dict) -> dict[str, Any]:
        try:
            return engine.answer()
        except SupersededError:
            return {"late": True}

    def settle(_question: dict) -> dict[str, Any]:
        try:
            return engine.settle()
        except SupersededError:
            return {"late": True}

    def done(_question: dict) -> dict[str, Any]:
        engine.result()
        return {}

    return {
        "open": everything,
        "near": near,
        "press": press,
        "frame": add_frame,
        "drag": drag,
        "prepare": prepare,
        "drop": lambda _question: engine.drop(),
        "remove": remove,
        "undo": undo,
        "redo": redo,
        "choose": choose,
        "answer": answer,
        "settle": settle,
        "done": done,
        "cancel": lambda _question: {},
    }


def _points(value: Any) -> Array:
    """(k, 2) from JSON.  Raises ValueError or TypeError."""
    points = np.array(value, dtype=float)
    if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():
        raise ValueError(value)
    return points


def _point(value: Any) -> Array:
    return _points([value])[0]


def _size(value: Any) -> float:
    size = float(value)
    if not np.isfinite(size):
        raise ValueError(value)
    return size
