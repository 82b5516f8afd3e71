# SPDX-License-Identifier: GPL-2.0-or-later
"""Strategies for small, unusual drawings, and for edits between two runs.

A *document* is text.  Its shapes are on a coarse grid, so that points, lines and whole curves coincide, cross and lie
next to each other; some numbers are extreme.  They are in groups under transforms of every kind, among everything
else that files contain.  Handles are put on the curves afterwards, as the package reads them.  A kept case is the
finished text, with the effect's arguments in a comment.
"""

# XML is read more easily on one line.
# ruff: noqa: E501

from __future__ import annotations

import copy
import io
from dataclasses import dataclass
from typing import Any, Sequence

import inkex
import numpy as np
from documents import ALUP, INKSCAPE, SODIPODI
from hypothesis import strategies as st
from lxml import etree

from alup.document import reading
from alup.geometry import bezier
from alup.messages.errors import AlupError

HEAD = (
    f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" xmlns:inkscape="{INKSCAPE}" '
    f'xmlns:sodipodi="{SODIPODI}" xmlns:alup="{ALUP}" '
)


def once_in(draw: Any, count: int) -> bool:
    """True once in so many draws.  (The ends of a range are drawn more often.)"""
    return bool(draw(st.integers(0, count)) == count // 2 + 1)


# --- numbers ------------------------------------------------------------------------------------

GRID = st.sampled_from([0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100])
NUDGE = st.sampled_from([0.0, 0.0, 0.0, 1e-12, -1e-9, 1e-6, 1e-4, -0.01, 0.05, 0.3, 1.0])
EXTREME = st.sampled_from(
    ["1e-12", "-1e-12", "1e12", "-1e12", "1e9", "999999999", "1e300", "1e-320", "1e-400", "-0", "+.5", "5.", "1e5", "-30000"]
)  # fmt: skip
BROKEN = st.sampled_from(
    ["nan", "inf", "1e999", "", "1e", "x", "--1", "1.2.3", "0x10", "٣", "1,", "#", "\u00a0"]
)


@st.composite
def numbers(draw: Any) -> str:
    """A coordinate: mostly on the grid or close beside it."""
    if once_in(draw, 250):
        return str(draw(EXTREME))
    if once_in(draw, 4):
        return repr(round(draw(st.floats(-50.0, 150.0)), draw(st.integers(0, 9))))
    value = draw(GRID) + draw(NUDGE)
    return f"{value:.12g}"


def radii() -> Any:
    return st.one_of(numbers(), st.sampled_from(["0", "5", "20", "50", "50.000001", "-20", "1e-9"]))


FLAGS = st.sampled_from(["0", "1"])
ANGLES = st.sampled_from(["0", "45", "90", "-30", "360", "1e-9", "720.5"])
COUNTS = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}


# --- path data ----------------------------------------------------------------------------------


@st.composite
def commands(draw: Any, letters: str) -> str:
    letter = draw(st.sampled_from(letters))
    upper = letter.upper()
    if upper == "A":
        words = [
            draw(radii()),
            draw(radii()),
            draw(ANGLES),
            draw(FLAGS),
            draw(FLAGS),
            draw(numbers()),
            draw(numbers()),
        ]
    else:
        words = [draw(numbers()) for _ in range(COUNTS[upper])]
    return letter + draw(st.sampled_from([" ", ",", " , ", "\n"])).join(words)


@st.composite
def path_data(draw: Any) -> str:
    """Path data; one in twenty can't be read."""
    if once_in(draw, 10):
        return str(draw(st.sampled_from(
            ["", "M10,10", "M10,10Z", "M10,10 L10,10", "M0,0 H50 H0", "M0,0 H50 M50,0 H0", "M0,0 L50,50 L0,0 Z",
             "M0,0 C50,0 50,0 0,0", "M0,0 C0,0 50,50 50,50", "M0,0 A5,5 0 0 1 0,0", "M0,0 A0,5 0 0 1 30,0", "M5,5 z m 3,3 z",
             "M0,0 H50 V50 H0 Z M10,10 H40 V40 H10 Z", "M0,0 100,100 M100,0 0,100", "M0 0h10h-10h10", "m10 10zl5 5", "M0,0 a1 1 0 01.5.5",
             "M0,50 C100,50 0,50 100,50", "M0,0 H1e-7", "M 30,30 A 20,20 0 1 1 30,30.000001 Z", "M0,0 Q 50,100 100,0 T 200,0 T 300,0"]
        )))  # fmt: skip
    parts = ["M" + draw(numbers()) + "," + draw(numbers())]
    for _ in range(draw(st.integers(1, 7))):
        parts.append(draw(commands("LLLlhHvVCcSsQqTtAaZzMm")))
    text = draw(st.sampled_from([" ", ""])).join(parts)
    if once_in(draw, 60):
        at = draw(st.integers(0, len(text)))
        text = text[:at] + draw(BROKEN) + text[at:]
    return text


# --- attributes ---------------------------------------------------------------------------------

TRANSFORMS = [
    "translate(10,-20)", "scale(-1,1)", "scale(2)", "scale(0.5 3)", "rotate(30)", "rotate(90, 50, 50)", "skewX(40)", "matrix(0,1,1,0,5,5)",
    "translate(1e3) scale(1e-3)", "scale(1e4)", "scale(1e-6)", "matrix(1 0 0 1 0 0)", "translate(0,0)", "none",
]  # fmt: skip
ODD_TRANSFORMS = [
    "scale(0)", "scale(0,1)", "matrix(1,2,2,4,0,0)", "skewX(90)", "skewY(89.9999999)", "scale(1e12)", "scale(1e-14)", "rotate()", "matrix(1,2,3)",
    "scale(1e300) scale(1e300)", "translate(1e400)", "scale(1e-300)", "rotate(1e30)", "foo(3)", "translate(1 2", "scale(nan)", "scale(1,1e-11)",
]  # fmt: skip
VIEWS = [
    'viewBox="0 0 200 200"',
    'viewBox="0 0 100 100" width="100mm" height="50mm"',
    'viewBox="-50 -50 400 100" preserveAspectRatio="none"',
    "",
]
ODD_VIEWS = [
    'viewBox="0 0 0 0"', 'viewBox="0 0 -10 10"', 'viewBox="a b c d"', 'viewBox="0 0 10"', 'viewBox=""', 'width="100%" height="100%"', 'width="0" height="0"',
    'viewBox="0 0 1e-9 1e-9" width="1in"', 'viewBox="0 0 1e12 1e12" width="10"', 'viewBox="nan nan nan nan"', 'width="5em"', 'viewBox="0,0,100,100" width="20cm"',
]  # fmt: skip
STYLES = [
    "fill:none;stroke:#000", "fill:url(#grad)", "fill:url(#pat);stroke:url(#grad)", "clip-path:url(#clip)", "mask:url(#mask)", "display:inline", "stroke-width:0",
    "fill:url(#none)", "clip-path:url(#none)", "fill:#f00;;stroke", "marker-end:url(#m)", "filter:url(#f)",
]  # fmt: skip
HIDDEN = ["display:none", "visibility:hidden", "visibility:collapse"]


def attribute(text: str) -> str:
    return text.replace("&", "&amp;").replace('"', "&quot;").replace("<", "&lt;")


def rarely(draw: Any, usual: Sequence[str], odd: Sequence[str], one_in: int = 25) -> str:
    return str(draw(st.sampled_from(odd if once_in(draw, one_in) else usual)))


@st.composite
def dressing(draw: Any) -> str:
    """Transform, style and what else an element may have."""
    words = []
    if once_in(draw, 4):
        words.append(f'transform="{rarely(draw, TRANSFORMS, ODD_TRANSFORMS, 25)}"')
    kind = draw(st.integers(0, 13))
    if kind < 4:
        words.append(f'style="{rarely(draw, STYLES, HIDDEN, 12)}"')
    elif kind == 4:
        words.append(draw(st.sampled_from([
            'sodipodi:insensitive="true"', 'inkscape:path-effect="#lpe"', 'class="a"', 'clip-path="url(#clip)"', 'sodipodi:nodetypes="cccc"', 'fill="url(#grad)"',
            'sodipodi:nodetypes="zz"', 'inkscape:label="x &lt; y"', 'mask="url(#mask)"', 'sodipodi:type="arc"', 'pathLength="0"', 'display="none"',
        ])))  # fmt: skip
    return " ".join(words)


LENGTHS = st.one_of(
    numbers(),
    numbers(),
    numbers(),
    st.sampled_from(["10mm", "50%", "1in", "0", "-5", "2pt", "", "auto", "5em", "1e400"]),
)


@st.composite
def shapes(draw: Any, identity: str) -> str:
    more = draw(dressing())
    tag = draw(st.sampled_from(["path"] * 8 + ["rect", "circle", "ellipse", "line", "polyline", "polygon"]))
    if tag == "path":
        d = draw(path_data())
        return f'<path id="{identity}" {more} d="{attribute(d)}"/>'
    if tag in ("polyline", "polygon"):
        points = " ".join(f"{draw(numbers())},{draw(numbers())}" for _ in range(draw(st.integers(0, 5))))
        if once_in(draw, 30):
            points += draw(st.sampled_from([" 5", " x", ",,", "1e999,0", " nan,1"]))
        return f'<{tag} id="{identity}" {more} points="{points}"/>'
    names = {
        "rect": ("x", "y", "width", "height", "rx", "ry"), "circle": ("cx", "cy", "r"), "ellipse": ("cx", "cy", "rx", "ry"),
        "line": ("x1", "y1", "x2", "y2"),
    }[tag]  # fmt: skip
    words = [
        f'{name}="{draw(LENGTHS)}"'
        for name in names
        if once_in(draw, 3) == (name in ("rx", "ry") and tag == "rect") or once_in(draw, 2)
    ]
    return f'<{tag} id="{identity}" {more} {" ".join(words)}/>'


EXTRAS = [
    '<use id="u" xlink:href="#s0"/>', '<use id="u" href="#u"/>', '<use id="u" xlink:href="#g0" transform="scale(0.5)"/>', '<use id="u" xlink:href="#nowhere"/>',
    '<text id="t" x="20" y="30">Hello <tspan dx="1,2">you</tspan></text>', '<image id="i" x="10" y="10" width="20" height="30"/>', "<!-- remark --><?php x ?>",
    '<svg id="inner" viewBox="0 0 1 1"><path id="deep" d="M0,0 H5"/></svg>', "<style>.a { fill: url(#grad) } path { stroke: red }</style>", "<foo:bar xmlns:foo='urn:x'/>",
    '<switch id="sw"><path id="s_sw" d="M0,0 H50 V20"/></switch>', '<g id="empty"/>', '<path id="s0" d="M0,0 H20"/>', "stray text", '<metadata id="md"/>',
    '<path d="M20,20 H70 V70"/>', '<text id="tp"><textPath xlink:href="#s0">on a path</textPath></text>', '<g id="gv" style="visibility:hidden"><path id="sv" style="visibility:visible" d="M0,0 H50"/></g>',
    '<path id="star" sodipodi:type="star" sodipodi:sides="5" d="M0,0 H50 V50 Z"/>', '<path id="lpe1" inkscape:path-effect="#lpe" inkscape:original-d="M0,0 H50" d="M0,0 H50 V1 Z"/>',
]  # fmt: skip


@st.composite
def bodies(draw: Any) -> str:
    """Definitions, some shapes in groups, other things between them."""
    parts = []
    if draw(st.booleans()):
        gradient = rarely(
            draw,
            ['gradientUnits="userSpaceOnUse" x1="0" x2="100"', "", 'r="5" gradientUnits="userSpaceOnUse"'],
            ['xlink:href="#grad"', 'gradientTransform="scale(0)"', 'x1="x"'],
            8,
        )
        clip = draw(shapes("cs"))
        parts.append(
            f'<defs><linearGradient id="grad" {gradient}><stop offset="0"/></linearGradient><clipPath id="clip">{clip}</clipPath>'
            '<pattern id="pat" patternUnits="userSpaceOnUse" width="10" height="10" patternTransform="rotate(9)"><rect width="3" height="3"/></pattern>'
            f'<mask id="mask"><rect id="mr" x="0" y="0" width="60" height="60"/></mask><inkscape:path-effect id="lpe" effect="spiro"/></defs>'
        )  # fmt: skip
    count = draw(st.integers(1, 5))
    open_groups = 0
    for n in range(count):
        while once_in(draw, 5) and open_groups < 4:
            parts.append(f'<g id="g{n}_{open_groups}" {draw(dressing())}>')
            open_groups += 1
        text = draw(shapes(f"s{n}"))
        parts.append(text)
        if once_in(draw, 12):
            parts.append(text.replace(f'id="s{n}"', f'id="twin{n}"'))
        if once_in(draw, 5):
            parts.append(draw(st.sampled_from(EXTRAS)))
        if open_groups and draw(st.integers(0, 2)) == 2:
            parts.append("</g>")
            open_groups -= 1
    return "".join(parts) + "</g>" * open_groups


# --- handles ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Wish:
    """A handle on the curves: which curve, where on it, its kind, the move in diagonals, the way beside it."""

    curve: int
    t: float
    kind: str
    move: tuple[float, float]
    beside: float


MOVES = st.sampled_from([0.0, 0.0, 0.05, -0.1, 0.2, -0.3, 0.5, 1e-9, 1e-5])
FAR_MOVES = st.sampled_from([3.0, -100.0, 1e6, 1e12, 1e-12])
# Handles that do not depend on the curves: malformed labels, handles off every curve, unusual shapes.
LOOSE = [
    '<circle id="off" inkscape:label="alup:pin" cx="1e4" cy="-1e4" r="1"/>', '<circle id="pinn" inkscape:label="alup:pinn" cx="0" cy="0" r="1"/>',
    '<circle id="lone" inkscape:label="alup:from lone" cx="0" cy="0" r="100"/>', '<circle id="h0" inkscape:label="alup:pin" cx="0" cy="0" r="0"/>',
    '<circle id="far" inkscape:label="alup:handle" alup:rest="1e300 0" cx="10" cy="10" r="5"/>', '<circle id="bad" inkscape:label="alup:handle" alup:rest="x" cx="0" cy="0" r="9"/>',
    '<rect id="sec" inkscape:label="alup:section" x="-10" y="-10" width="60" height="60"/>', '<rect id="sec" inkscape:label="alup:section" alup:rest="0 0 30 30" x="20" y="0" width="60" height="20"/>',
    '<rect id="sec" inkscape:label="alup:section" alup:rest="0 0 0 30" x="0" y="0" width="60" height="20"/>', '<rect id="sec" inkscape:label="alup:section" transform="scale(0)" width="9" height="9"/>',
    '<rect id="sec" inkscape:label="alup:section" alup:rest="-9 -9 300 300" x="0" y="0" width="1e-9" height="300"/>', '<text id="th" inkscape:label="alup:pin">x</text>',
    '<circle id="big" inkscape:label="alup:pin" cx="50" cy="50" r="1000"/>', '<path id="hp" inkscape:label="alup:pin" d="M0,0 H2 V2 Z"/>', '<g inkscape:label="alup: handles"/>',
    '<circle id="hs" inkscape:label="alup:pin" transform="scale(0)" cx="50" cy="50" r="1"/>', '<circle id="stale" inkscape:label="alup:handle" alup:rest="0 0" alup:at="10 10" cx="20" cy="0" r="5"/>',
    '<ellipse id="he" inkscape:label="alup:handle" alup:rest="nan 3" cx="0" cy="0" rx="2" ry="1"/>', '<circle id="e" inkscape:label="alup:" cx="0" cy="0" r="5"/>',
]  # fmt: skip


@st.composite
def wishes(draw: Any) -> list[Wish]:
    """Handles; of a third of the lists none is moved."""
    still = once_in(draw, 3)
    result = []
    for _ in range(draw(st.sampled_from([1, 2, 2, 3, 3, 4, 6]))):
        move = (0.0, 0.0) if still or draw(st.booleans()) else (draw(MOVES), draw(MOVES))
        if not still and once_in(draw, 40):
            move = (draw(FAR_MOVES), draw(MOVES))
        kind = draw(
            st.sampled_from(
                ["pin", "pair", "handle"] if any(move) else ["pin", "pin", "pin", "pair", "handle"]
            )
        )
        result.append(
            Wish(draw(st.integers(0, 12)), draw(st.sampled_from([0.0, 1.0, 0.5, 0.25, 1e-9, 0.999, 0.7])), kind, move, draw(st.sampled_from([0.0, 0.0, 0.0, 1e-9, 0.004])))
        )  # fmt: skip
    return result


# --- documents ----------------------------------------------------------------------------------


def loaded(text: str) -> Any:
    return inkex.load_svg(io.BytesIO(text.encode()))


@dataclass(frozen=True)
class Case:
    """A drawing and the handles that are wanted on it; loose : handles wherever they are."""

    head: str
    body: str
    wishes: tuple[Wish, ...]
    loose: str
    spoils: tuple[tuple[int, int, str], ...] = ()

    @property
    def bare(self) -> str:
        """Without handles on curves."""
        return f"{HEAD}{self.head}>{self.body}{self.loose}</svg>"

    def text(self) -> str:
        """The whole document: handles on the curves as the package reads them, none where it can't."""
        try:
            svg = loaded(f"{HEAD}{self.head}>{self.body}</svg>").getroot()
            drawing = reading.read(svg, [], True).drawing
        except AlupError:
            return self.bare
        marks = "".join(mark(drawing, n, wish) for n, wish in enumerate(self.wishes))
        return spoilt(self.bare[: -len("</svg>")] + marks + "</svg>", self.spoils)


def spoilt(text: str, spoils: Sequence[tuple[int, int, str]]) -> str:
    """The text with some attributes replaced.  spoils : number of the element and of its attribute, new value"""
    if not spoils:
        return text
    root = etree.fromstring(text.encode())
    elements = [element for element in root.iter() if isinstance(element.tag, str) and element.attrib]
    for number, which, value in spoils:
        attributes = elements[number % len(elements)].attrib
        attributes[sorted(attributes)[which % len(attributes)]] = value
    return str(etree.tostring(root, encoding="unicode"))


def mark(drawing: Any, n: int, wish: Wish) -> str:
    control = drawing.control[wish.curve % len(drawing.control)]
    at = bezier.evaluate(control, np.array(wish.t)) + [0.0, wish.beside * drawing.diagonal]
    to = at + np.array(wish.move) * drawing.diagonal
    radius = f"{max(0.005 * drawing.diagonal, 1e-300):.6g}"

    def circle(identity: str, label: str, where: Any, more: str = "") -> str:
        x, y = (repr(float(v)) for v in where)
        return f'<circle id="{identity}" inkscape:label="alup:{label}" cx="{x}" cy="{y}" r="{radius}"{more}/>'

    if wish.kind == "handle":
        return circle(f"w{n}", "handle", to, f' alup:rest="{float(at[0])!r} {float(at[1])!r}"')
    if wish.kind == "pair":
        return circle(f"w{n}", f"from {n}", at) + circle(f"v{n}", f"to {n}", to)
    return circle(f"w{n}", "pin", at)


ARGUMENTS = ["--hold=apart", "--add_nodes=false", "--hold=firmly", "--crossings=false", "--keep_handles=false", "--hold=loosely", "--snap=1", "--tolerance=5", "--spacing=0.7", "--solver=paper"]  # fmt: skip


WORDS = [
    "url(#grad)", "url(#s0)", "#s0", "none", "inherit", "translate(", "scale(", "matrix(", ")", "0", "1", "-1", "1e9", "1e-9", ".", ",", ";", ":", "%", "px",
    "M", "L", "C", "A", "z", "alup:", "pin", "from", "to", "handle", "section", "nan", "{", "}", "'", "é",
]  # fmt: skip
SPOILS = st.one_of(
    st.lists(st.sampled_from(WORDS), max_size=6).map(" ".join),
    st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs"), exclude_characters="\ufffe\uffff"), max_size=8),
)  # fmt: skip


@st.composite
def cases(draw: Any) -> Case:
    """A document, the arguments of the effect in a comment."""
    head = rarely(draw, VIEWS, ODD_VIEWS, 10)
    body = draw(bodies())
    loose = [draw(st.sampled_from(LOOSE))] if once_in(draw, 15) else []
    chosen = draw(st.sampled_from([(), (), (), *((a,) for a in ARGUMENTS)]))
    remark = f"<!--arguments {' '.join(a.replace('--', '', 1) for a in chosen)}-->" if chosen else ""
    spoils: tuple[tuple[int, int, str], ...] = ()
    if once_in(draw, 6):
        spoils = ((draw(st.integers(0, 40)), draw(st.integers(0, 9)), draw(SPOILS)),)
    return Case(head, remark + body, tuple(draw(wishes())), "".join(loose), spoils)


# --- edits between two runs ----------------------------------------------------------------------


@dataclass(frozen=True)
class Edit:
    """An edit of one element between two runs: of an attribute or its place, a copy, a deletion."""

    element: int
    what: str
    which: int
    value: str


EDITS = (
    "attribute",
    "attribute",
    "transform",
    "path",
    "handle",
    "copy",
    "delete",
    "to the end",
    "drop attribute",
)


@st.composite
def edits(draw: Any) -> tuple[Edit, ...]:
    result = []
    for _ in range(draw(st.integers(1, 3))):
        what = draw(st.sampled_from(EDITS))
        value = draw(
            {"path": path_data(), "transform": st.sampled_from(TRANSFORMS), "handle": GRID.map(str)}.get(
                what, SPOILS
            )
        )
        result.append(Edit(draw(st.integers(0, 40)), what, draw(st.integers(0, 9)), value))
    return tuple(result)


def edited(text: str, changes: Sequence[Edit]) -> str:
    """The document after edits, as a person or a text editor makes them."""
    root = etree.fromstring(text.encode())
    for edit in changes:
        wanted = {"path": "path", "handle": "circle"}.get(edit.what, "*")
        found = [e for e in root.iter(f"{{*}}{wanted}") if e is not root or edit.what == "attribute"]
        found = [e for e in found if e.attrib]
        if not found:
            continue
        element = found[edit.element % len(found)]
        name = sorted(element.attrib)[edit.which % len(element.attrib)]
        if edit.what == "attribute":
            element.attrib[name] = edit.value
        elif edit.what == "drop attribute":
            del element.attrib[name]
        elif edit.what == "transform":
            element.attrib["transform"] = edit.value
        elif edit.what == "path":
            element.attrib["d"] = edit.value
        elif edit.what == "handle":
            element.attrib["cx"] = edit.value
        elif edit.what == "delete":
            parent = element.getparent()
            assert parent is not None
            parent.remove(element)
        elif edit.what == "copy":
            twin = copy.deepcopy(element)
            twin.attrib["id"] = f"copy{edit.which}"
            element.addnext(twin)
        else:
            root.append(element)
    return str(etree.tostring(root, encoding="unicode"))


# --- drawings without a document -----------------------------------------------------------------


@st.composite
def drawings(draw: Any) -> tuple[list[str], list[Wish]]:
    """Path data that can be read, of the size of the grid, and where handles are to be."""
    steps = st.one_of(GRID.map(float), st.tuples(GRID, NUDGE).map(sum))
    paths = []
    for _ in range(draw(st.integers(1, 5))):
        words = [f"M{draw(steps)!r},{draw(steps)!r}"]
        for n in range(draw(st.integers(1, 6))):
            letter = draw(st.sampled_from("LLLHVCSQTAZM" if n else "LLHVCQTA"))
            numbers_ = [repr(draw(steps)) for _ in range(COUNTS[letter])]
            if letter == "A":
                numbers_[3:5] = [draw(FLAGS), draw(FLAGS)]
            words.append(letter + " ".join(numbers_))
        paths.append(" ".join(words))
    return paths, draw(wishes())
