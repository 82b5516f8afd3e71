# SPDX-License-Identifier: GPL-2.0-or-later
"""Clones, filters, regions, patterns and rules when what they belong to is moved as a whole."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from companions import (
    AWAY,
    CLIP,
    CORNERS,
    FILLED,
    GRADIENT,
    LARGER,
    RECT,
    TEXT,
    WIDER,
    Array,
    affine,
    load,
    paint_of,
    run,
)
from lxml import etree

from alup.document import reading, restore_original, writing
from alup.document.tree import elements, loading
from alup.session import pipeline

SHIFT = np.array([150.0, 70.0])  # of AWAY


def place(element: Any) -> Array:
    """(3, 3) own coordinates -> root user units."""
    return elements.parent_matrix(element) @ elements.own_matrix(element)


def numbers(element: Any, *names: str) -> Array:
    return np.array([float(element.attrib[name]) for name in names])


# --- clones ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("transform", ["matrix(-1 0 0 1 260 0)", "rotate(90 130 100)", "translate(5,100)"])
def test_a_clone_moves_with_its_original_whichever_way_it_is_turned(transform: str) -> None:
    done = run(RECT.format("") + f'<use id="u" xlink:href="#r" transform="{transform}"/>', "r u", AWAY)
    was = elements.own_matrix(done["u"], text=transform)
    corners = np.column_stack([CORNERS, np.ones(4)])
    new = np.column_stack([AWAY(np.array(CORNERS)), np.ones(4)])
    expected = (corners @ was.T)[:, :2] + SHIFT
    np.testing.assert_allclose((new @ place(done["u"]).T)[:, :2], expected, atol=1e-2)
    assert done.skipped == []


def test_a_clone_grows_with_the_drawing_as_its_original_does() -> None:
    done = run(RECT.format("") + '<use id="u" xlink:href="#r" y="100"/>', "r u", LARGER)
    corners = np.column_stack([LARGER(np.array(CORNERS)) + (0, 100), np.ones(4)])
    np.testing.assert_allclose(
        (corners @ place(done["u"]).T)[:, :2], LARGER(np.array(CORNERS) + (0, 100)), atol=1e-2
    )


def test_a_clone_of_what_is_only_defined_is_carried() -> None:
    body = RECT.format("") + '<defs><circle id="d" r="5"/></defs><use id="u" xlink:href="#d" x="60" y="50"/>'
    done = run(body, "r u", AWAY)
    np.testing.assert_allclose(place(done["u"])[:2, 2], SHIFT, atol=1e-3)
    assert done.skipped == []


def test_petals_stay_about_the_middle_where_the_first_one_grows() -> None:
    petal = '<path id="r" d="M 0,0 C -20,-30 -20,-50 0,-80 C 20,-50 20,-30 0,0 Z"/>'
    others = "".join(f'<use id="u{n}" xlink:href="#r" transform="rotate({90 * n})"/>' for n in (1, 2, 3))
    longer = affine((1.0, 1.5), (0.0, 0.0))
    body = f'<g transform="translate(200,150)">{petal}{others}</g>'
    points = [(200, 150), (200, 70)]
    done = run(body, "r u1 u2 u3", lambda p: longer(p - (200, 150)) + (200, 150), points=points)
    for n in (1, 2, 3):
        assert elements.own_matrix(done[f"u{n}"])[:2, 2] == pytest.approx([0.0, 0.0], abs=1.0)


def test_a_seam_with_a_mirrored_clone_that_opens_is_named() -> None:
    half = '<path id="r" d="M 120,20 H 60 L 40,120 H 120 Z"/>'
    body = half + '<use id="u" xlink:href="#r" transform="matrix(-1 0 0 1 240 0)"/>'
    handles = [(60, 20), (40, 120), (120, 20), (120, 120)]
    done = run(body, "r u", lambda p: p - (30.0, 0.0) if p[0] > 100 and p[1] > 100 else p, points=handles)
    assert done.skipped == ["u"]


def test_what_a_clone_paints_its_original_with_follows() -> None:
    body = f'<defs>{GRADIENT}</defs>{RECT.format("")}<use id="u" xlink:href="#r" y="100" fill="url(#g)"/>'
    done = run(body, "r u", AWAY)
    gradient = done[paint_of(done["u"])]
    matrix = elements.own_matrix(gradient, "gradientTransform")
    np.testing.assert_allclose(matrix[:2, 2], SHIFT, atol=1e-2)


def test_a_clip_follows_what_is_beside_a_clone_in_its_group() -> None:
    body = (
        f'<defs>{CLIP}<circle id="d" r="3"/></defs>'
        f'<g id="k" clip-path="url(#c)">{RECT.format("")}<use id="u" xlink:href="#d" x="60" y="50"/></g>'
    )
    done = run(body, "k", AWAY)
    corner = done.control(done["cr"]).reshape(-1, 2).min(axis=0)
    np.testing.assert_allclose(corner, SHIFT + (40, 10), atol=1e-2)


def test_a_clip_on_a_text_alone_follows_it() -> None:
    body = f'<defs>{CLIP}</defs>{RECT.format("")}<g id="k" clip-path="url(#c)">{TEXT.format("")}</g>'
    done = run(body, "r k", AWAY)
    corner = done.control(done["cr"]).reshape(-1, 2).min(axis=0)
    np.testing.assert_allclose(corner, SHIFT + (40, 10), atol=1e-2)


def test_clones_go_back_and_start_again_from_where_they_were() -> None:
    body = RECT.format("") + '<use id="u" xlink:href="#r" transform="matrix(-1 0 0 1 260 0)"/>'
    done = run(body, "r u", AWAY)
    first = place(done["u"])
    read = reading.read(done.root, [], True)
    assert read.edited == []
    assert elements.own_matrix(done["u"]) == pytest.approx(first)
    restore_original.restore(done.root, [])
    np.testing.assert_allclose(place(done["u"]), [[-1, 0, 260], [0, 1, 0], [0, 0, 1]], atol=1e-9)


@pytest.mark.parametrize(
    ("x", "moved"),
    [(105.0, 50.0), (75.0, 55.0 * 50.0 / 110.0)],
    ids=["near the front, with it", "between samples of the middle, as the side under it"],
)
@pytest.mark.parametrize("held", [2, 4], ids=["nearly still", "still"])
def test_a_clone_keeps_its_place_on_a_side_that_is_stretched(x: float, moved: float, held: int) -> None:
    """Its original is another wheel, whose size it keeps."""
    side = '<path id="r" d="M20,60 H130 V100 H20 Z"/><circle id="w" cx="45" cy="100" r="12"/>'
    wheel = [(45, 112), (33, 100), (57, 100), (45, 88)][:held]
    ends = [(20, 60), (130, 60), (130, 100), *wheel]
    wider = {(130, 60): (180, 60), (130, 100): (180, 100)}
    clone = f'<use id="u" xlink:href="#w" x="{x - 45}"/>'
    done = run(
        side + clone, "r w u", lambda p: np.array(wider.get((p[0], p[1]), p), dtype=float), points=ends
    )
    np.testing.assert_allclose(place(done["u"])[:2, :2], np.eye(2))
    assert place(done["u"])[0, 2] == pytest.approx(moved, abs=0.5)
    assert place(done["u"])[1, 2] == pytest.approx(0.0, abs=0.1)
    assert done.skipped == []


@pytest.mark.parametrize("size", [1.0, 2.0])
def test_corners_that_part_take_no_clone_along(size: float) -> None:
    """All four corners are near; only two of them move."""
    side = '<path id="r" d="M20,60 H50 V80 H20 Z"/><circle id="w" cx="35" cy="180" r="12"/>'
    wider = {(50, 60): (50 + 20 * size, 60), (50, 80): (50 + 20 * size, 80)}
    done = run(
        side + '<use id="u" xlink:href="#w" y="-100"/>',
        "r w u",
        lambda p: np.array(wider.get((p[0], p[1]), p), dtype=float),
        points=[(20, 60), (50, 60), (50, 80), (20, 80), (35, 192), (23, 180), (47, 180)],
    )
    assert place(done["u"])[0, 2] == pytest.approx(10.0 * size, abs=0.5)


# --- filters and regions --------------------------------------------------------------------------

SHADOW = (
    '<filter id="f" filterUnits="userSpaceOnUse" x="15" y="15" width="110" height="75">'
    '<feFlood id="flood" x="30" y="30" width="20" height="10"/>'
    '<feDiffuseLighting><fePointLight id="light" x="60" y="40" z="20"/></feDiffuseLighting>'
    '<feSpecularLighting><feSpotLight id="spot" x="50" pointsAtX="70" pointsAtY="50"/></feSpecularLighting>'
    "</filter>"
)


@pytest.mark.parametrize("holder", ["shape", "group"])
def test_a_filter_in_user_space_follows(holder: str) -> None:
    if holder == "shape":
        body = RECT.format('filter="url(#f)"')
    else:
        body = f'<g filter="url(#f)">{RECT.format("")}</g>'
    done = run(SHADOW + body, "r", AWAY)
    np.testing.assert_allclose(numbers(done["f"], "x", "y", "width", "height"), [165, 85, 110, 75], atol=1e-2)
    np.testing.assert_allclose(numbers(done["flood"], "x", "y"), [180, 100], atol=1e-2)
    np.testing.assert_allclose(numbers(done["light"], "x", "y", "z"), [210, 110, 20], atol=1e-2)
    np.testing.assert_allclose(numbers(done["spot"], "x", "y", "pointsAtX"), [200, 70, 220], atol=1e-2)


def test_a_region_keeps_its_margin_for_the_blur() -> None:
    done = run(SHADOW + RECT.format('filter="url(#f)"'), "r", WIDER)
    np.testing.assert_allclose(numbers(done["f"], "x", "width"), [15, 310], atol=1e-2)


def test_a_filter_that_others_have_too_is_copied() -> None:
    other = '<rect id="o" x="20" y="200" width="9" height="9" filter="url(#f)"/>'
    done = run(SHADOW + RECT.format('filter="url(#f)"') + other, "r", AWAY)
    assert done["o"].attrib["filter"] == "url(#f)"
    assert done["f"].attrib["x"] == "15"
    copied = paint_of(done["r"], "filter")
    np.testing.assert_allclose(numbers(done[copied], "x", "y"), [165, 85], atol=1e-2)


def test_a_filter_goes_back_with_its_shape() -> None:
    done = run(SHADOW + RECT.format('filter="url(#f)"'), "r", AWAY)
    read = reading.read(done.root, [], True)
    assert read.edited == []
    restore_original.restore(done.root, [])
    np.testing.assert_allclose(numbers(done["f"], "x", "y"), [15, 15], atol=1e-9)
    np.testing.assert_allclose(numbers(done["light"], "x", "y"), [60, 40], atol=1e-9)


@pytest.mark.parametrize(
    "sides", ['x="5%" y="5%" width="30%" height="30%"', 'x="20" y="15" height="90"', ""], ids=str
)
def test_a_masks_region_follows_in_percent_and_with_sides_left_out(sides: str) -> None:
    mask = (
        f'<mask id="m" maskUnits="userSpaceOnUse" {sides}><rect width="400" height="300" fill="#fff"/></mask>'
    )
    done = run(mask + RECT.format('mask="url(#m)"'), "r", AWAY)
    given = load(mask)
    was = np.array([-40.0, -30.0, 480.0, 360.0])
    percent = {"x": 400, "width": 400, "y": 300, "height": 300}
    for name, whole in percent.items():
        text = given[0].attrib.get(name)
        place_of = ["x", "y", "width", "height"].index(name)
        if text:
            was[place_of] = float(text.rstrip("%")) * (whole / 100 if "%" in text else 1)
    expected = was + [*SHIFT, 0, 0]
    np.testing.assert_allclose(numbers(done["m"], "x", "y", "width", "height"), expected, atol=0.05)


def test_the_transform_of_a_pattern_in_units_of_the_box_moves_no_further_than_the_box() -> None:
    pattern = '<pattern id="p" width=".25" height=".25" patternTransform="scale(2) rotate(10)"/>'
    done = run(pattern + RECT.format('fill="url(#p)"'), "r", AWAY)
    now = elements.own_matrix(done["p"], "patternTransform")
    was = elements.own_matrix(load(pattern)[0], "patternTransform")
    corner, new = np.array([20.0, 20.0, 1.0]), np.array([*(SHIFT + 20.0), 1.0])
    np.testing.assert_allclose((now @ new)[:2], (was @ corner)[:2] + SHIFT, atol=1e-2)


BOX_CLIP = '<clipPath id="c" clipPathUnits="objectBoundingBox"{}><circle cx=".5" cy=".5" r=".4"/></clipPath>'


def test_a_hidden_part_of_the_box_that_a_clip_depends_on_moves_along() -> None:
    hidden = '<rect id="h" x="5" y="5" width="130" height="90" visibility="hidden"/>'
    body = f'{BOX_CLIP.format("")}<g clip-path="url(#c)">{hidden}{RECT.format("")}</g>'
    root = load(body, AWAY)
    read = reading.read(root, [], True)
    result = pipeline.reshape(read.drawing, pipeline.Options())
    writing.write(read, result.refitted, True, 1e-3)
    np.testing.assert_allclose(place(root.getElementById("h"))[:2, 2], SHIFT, atol=1e-2)
    assert reading.read(root, [], True).edited == []
    restore_original.restore(root, [])
    np.testing.assert_allclose(place(root.getElementById("h"))[:2, 2], 0, atol=1e-9)


def test_a_transform_in_units_of_the_box_is_named() -> None:
    done = run(BOX_CLIP.format(' transform="rotate(9)"') + RECT.format('clip-path="url(#c)"'), "r", AWAY)
    assert done.skipped == ["r"]


# --- rules ----------------------------------------------------------------------------------------


def test_a_rule_for_paths_does_not_take_the_paint_of_a_rectangle() -> None:
    done = run("<style>path{fill:none}</style>" + RECT.format('fill="teal"'), "r", AWAY)
    assert "fill:teal" in done["r"].attrib["style"]


def test_a_gradient_that_follows_is_seen_beside_a_rule_for_paths() -> None:
    other = '<rect id="o" x="20" y="200" width="9" height="9" fill="url(#g)"/>'
    body = f"<style>path{{fill:none}}</style><defs>{GRADIENT}</defs>{FILLED}"
    done = run(body + other, "r", AWAY)
    assert paint_of(done["r"]) not in ("g", "none")


@pytest.mark.parametrize("selector", ["rect", "rect[width]"])
def test_what_a_selector_gave_a_rectangle_stays(selector: str) -> None:
    done = run(f"<style>{selector}{{fill:red}}</style>" + RECT.format(""), "r", AWAY)
    assert "fill:red" in done["r"].attrib["style"]


def test_what_a_selector_gave_the_neighbour_of_a_rectangle_stays() -> None:
    done = run("<style>rect + text{fill:red}</style>" + RECT.format("") + TEXT.format(""), "r", AWAY)
    assert "fill:red" in done["t"].attrib["style"]


IN_CSS = {
    "a radius": '<circle id="k" cx="60" cy="160" r="9" style="r:30px"/>',
    "a rule": '<style>#k{cx:60px;cy:160px;r:20%}</style><circle id="k"/>',
    "path data": """<path id="k" style="d:path('M 40,150 L 80,150 L 60,190 Z')"/>""",
    "an image": '<image id="k" x="40" y="150" href="a.png" style="width:40px;height:30px"/>',
}


@pytest.mark.parametrize("kind", IN_CSS)
def test_what_has_its_geometry_in_css_moves_by_its_transform_and_goes_back(kind: str) -> None:
    svg = load(RECT.format("") + IN_CSS[kind], AWAY)
    before = dict(svg.getElementById("k").attrib)
    drawing = reading.read(svg, [], True)
    result = pipeline.reshape(drawing.drawing, pipeline.Options())
    writing.write(drawing, result.refitted, True, 1e-3)
    assert drawing.skipped == []
    moved = svg.getElementById("k")
    np.testing.assert_allclose(
        elements.own_matrix(moved)[:2], [[1, 0, SHIFT[0]], [0, 1, SHIFT[1]]], atol=1e-2
    )
    assert before.items() <= dict(moved.attrib).items()
    assert reading.read(svg, [], True).edited == []
    restore_original.restore(svg, [])
    assert dict(svg.getElementById("k").attrib) == before


@pytest.mark.parametrize(("style", "move"), [("r:30px", WIDER), ("transform:translate(3px,4px)", AWAY)])
def test_what_has_its_geometry_in_css_and_would_change_its_shape_is_named(style: str, move: Any) -> None:
    circle = f'<circle id="k" cx="60" cy="160" r="9" style="{style}"/>'
    done = run(RECT.format("") + circle, "r k", move)
    assert done.skipped == ["k"]
    assert done["k"].attrib["style"] == style


def test_objects_of_an_entity_are_named() -> None:
    text = etree.tostring(load(RECT.format(""), AWAY), encoding="unicode").replace("<rect", "&one;<rect", 1)
    declared = '<!DOCTYPE svg [<!ENTITY one \'<rect width="9" height="9"/>\'>]>' + text
    root = loading.parse(declared.encode()).getroot()
    assert [entry["id"] for entry in reading.read(root, [], True).skipped] == ["&one;"]


MARKER = '<marker id="m"><path d="M 0,0 L 9,5"/></marker><g marker-end="url(#m)">{}</g>'


def test_no_marker_appears_on_a_rectangle() -> None:
    def bent(point: Any) -> Any:
        return np.array(point) + (np.array([30.0, 9.0]) if tuple(point) == CORNERS[0] else 0.0)

    done = run(MARKER.format(RECT.format("")), "r", bent)
    assert elements.local_tag(done["r"]) == "path"
    assert "marker-end:none" in done["r"].attrib["style"]


KINDS = {
    "rect": ('<rect id="r" x="20" y="20" width="200" height="100" ry="8"/>', "x y width height"),
    "ellipse": ('<ellipse id="r" cx="120" cy="70" rx="100" ry="50"/>', "cx cy rx ry"),
    "circle": ('<circle id="r" cx="120" cy="70" r="50"/>', "cx cy r"),
}
TOUCHED = {
    "rect": [(28, 20), (120, 20), (220, 70), (120, 120), (20, 70)],
    "ellipse": [(220, 70), (20, 70), (120, 20), (120, 120)],
    "circle": [(170, 70), (70, 70), (120, 20), (120, 120)],
}


@pytest.mark.parametrize("move", [AWAY, LARGER], ids=["shifted", "larger"])
@pytest.mark.parametrize("kind", KINDS)
def test_what_has_a_marker_in_some_programs_only_stays_of_its_kind(kind: str, move: Any) -> None:
    body, names = KINDS[kind]
    svg = load(MARKER.format(body), move, points=TOUCHED[kind])
    shape = svg.getElementById("r")
    before = dict(shape.attrib)
    control = elements.read_shape(shape, np.eye(3)[:2]).control

    def reshape() -> reading.Document:
        read = reading.read(svg, [], True)
        result = pipeline.reshape(read.drawing, pipeline.Options())
        writing.write(read, result.refitted, True, 0.1)
        return read

    reshape()
    assert elements.local_tag(shape) == kind
    assert set(dict(shape.attrib)) >= set(names.split())
    wanted = move(control.reshape(-1, 2)).reshape(-1, 4, 2)
    np.testing.assert_allclose(elements.read_shape(shape, np.eye(3)[:2]).control, wanted, atol=0.05)
    again = reshape()
    assert again.edited == []
    assert again.from_original == ["r"]
    np.testing.assert_allclose(elements.read_shape(shape, np.eye(3)[:2]).control, wanted, atol=0.05)
    restore_original.restore(svg, [])
    assert dict(shape.attrib) == before


def test_a_rectangle_that_was_edited_after_a_run_is_a_new_start() -> None:
    done = run(MARKER.format(RECT.format("")), "r", AWAY)
    done["r"].attrib["width"] = "300"
    assert reading.read(done.root, [], True).edited == ["r"]


def test_more_markers_because_of_more_nodes_are_named() -> None:
    marker = '<marker id="m"><path d="M 0,0 L 9,5"/></marker>'
    path = '<path id="r" fill="none" marker-mid="url(#m)" d="M 20,80 C 60,80 80,20 120,20 S 180,80 220,80"/>'
    done = run(marker + path, "r", affine((1.0, 1.0), (90.0, -60.0)), points=[(220, 80)])
    assert done.skipped == []
    pinned = run(
        marker + path,
        "r",
        lambda p: p + ([150.0, -90.0] if p[0] > 200 else [0, 0]),
        points=[(20, 80), (120, 20), (220, 80)],
    )
    nodes = pinned["r"].attrib["d"].count("C")
    assert (nodes > 2) == (pinned.skipped == ["r"])
    assert nodes > 2
    svg = load(
        marker + path,
        lambda p: p + ([150.0, -90.0] if p[0] > 200 else [0, 0]),
        points=[(20, 80), (120, 20), (220, 80)],
    )
    read = reading.read(svg, [], True)
    result = pipeline.reshape(read.drawing, pipeline.Options(add_nodes=False))
    assert writing.write(read, result.refitted, True, 1e-3) == ["r"]
    (kept,) = [element for element in svg.iter() if element.get("id") == "r"]
    assert kept.attrib["d"].count("C") == 2
    assert read.skipped == []
