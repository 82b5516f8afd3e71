# SPDX-License-Identifier: GPL-2.0-or-later
"""The live window in a real Chromium: pins, drags, frames, its ends, hostile drawings, other origins."""

from __future__ import annotations

import http.server
import os
import shutil
import subprocess
import sys
import threading
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Iterator

import chromium as harness
import hostile
import numpy as np
import pytest
import reruns
from lxml import etree
from test_live_engine import CART, FREE, HOUSE, moved_from

from alup import run
from alup.document.tree import loading, shown
from alup.live import window as live_window
from alup.live.engine import Engine
from alup.live.server import Server
from alup.session.options import Options
from alup.svg import path_data

pytestmark = [
    pytest.mark.skipif(harness.PROGRAM is None, reason="Chromium is not installed"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
]

DRAWING = etree.tostring(reruns.load(HOUSE))
TOP, LEFT, RIGHT, DOOR = (60.0, 20.0), (20.0, 160.0), (160.0, 160.0), (60.0, 120.0)
EXACT = 1e-6  # of the diagonal
REST = "{https://alup-reshape.github.io/ns}rest"


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with harness.chromium() as found:
        yield found


@pytest.fixture
def window(browser: Any) -> Iterator[harness.Window]:
    context = browser.new_context(viewport={"width": 1000, "height": 700})
    yield harness.Window(context.new_page())
    context.close()


@contextmanager
def served(data: bytes) -> Iterator[tuple[Engine, Server]]:
    """An engine and its server in this process."""
    engine = Engine(loading.parse(data).getroot(), [], Options())
    server = Server(live_window.answers(engine))
    try:
        yield engine, server
    finally:
        server.close()
        engine.close()


@pytest.fixture
def drawing(tmp_path: Path) -> Path:
    file = tmp_path / "house.svg"
    file.write_bytes(DRAWING)
    return file


# --- a whole visit ------------------------------------------------------------------------------


def test_pins_are_set_dragged_and_written(window: harness.Window, drawing: Path, tmp_path: Path) -> None:
    page = window.page
    with harness.effect(drawing, tmp_path) as effect:
        window.open(effect.address)
        assert "#" not in page.url
        assert page.is_visible("#first")
        house, box = window.data("house"), window.data("box")

        # A click on a curve is a pin; a click beside one is none.
        for count, point in enumerate((LEFT, RIGHT, TOP), start=1):
            window.click(point)
            window.wait_for_pins(count)
        assert not page.is_visible("#first")
        window.click((60.0, 60.0))
        assert len(window.pins()) == 3

        # The path changes while the pin is dragged, and again as it goes on.
        start, seen = window.at(TOP), {window.data("house")}
        page.mouse.move(*start)
        page.mouse.down()
        for n in range(1, 4):
            page.mouse.move(start[0] + 8 * n, start[1] - 12 * n)
            script = f"(was) => ({harness._DATA})('house') !== was"
            page.wait_for_function(script, arg=window.data("house"))
            seen.add(window.data("house"))
        assert len(seen) == 4
        page.mouse.up()
        window.settled()
        assert "met" in page.inner_text("#line")
        dragged = window.data("house")
        assert page.get_attribute(".pin.moved", "aria-label") == "Pin 3, moved"

        # A step back and on again.
        page.keyboard.press("Control+z")
        page.wait_for_function("() => !document.querySelector('.pin.moved')")
        window.settled()
        assert_same(window.data("house"), house)
        assert_same(window.data("box"), box)
        page.keyboard.press("Control+Shift+z")
        page.wait_for_selector(".pin.moved")
        window.settled()
        assert_same(window.data("house"), dragged)

        # Done writes what a batch run of the same handles does.
        page.click("#done")
        assert effect.end() == 0
        assert effect.words == ""
        new = etree.parse(str(effect.output)).getroot()
    circles = {c.attrib[REST]: (float(c.attrib["cx"]), float(c.attrib["cy"])) for c in new.iter("{*}circle")}
    assert len(circles) == 3
    assert (
        sum(
            np.abs(np.subtract(at, [float(x) for x in rest.split()])).max() > 4.0
            for rest, at in circles.items()
        )
        == 1
    )
    batch = reruns.load(HOUSE + "".join(moved_from(rest, *at) for rest, at in circles.items()))
    run.reshape(batch, [], Options())
    for identity in ("house", "door", "box"):
        one, other = reruns.control(reruns.reloaded(new), identity), reruns.control(batch, identity)
        assert np.abs(one - other).max() <= EXACT * 200.0


def assert_same(one: str, other: str) -> None:
    """The same outline but for rounding, whatever its letters."""
    a, b = (np.concatenate([part.control for part in path_data.parse(d)]) for d in (one, other))
    assert np.abs(a - b).max() < 1e-2


def set_pins(window: harness.Window, *points: tuple[float, float]) -> None:
    """Click on points of the curves, one after the other."""
    for count, point in enumerate(points, start=1):
        window.click(point)
        window.wait_for_pins(count)


def test_a_pin_lets_go_and_a_frame_moves_a_part(window: harness.Window) -> None:
    page = window.page
    with served(DRAWING) as (engine, server):
        window.open(server.address)
        set_pins(window, LEFT, TOP)
        page.keyboard.press("Delete")
        window.wait_for_pins(1)
        # A rectangle around the box is a frame; its middle moves it.
        window.drag((110.0, 92.0), (170.0, 168.0))
        page.wait_for_selector(".pin.frame")
        assert page.locator(".pin.corner").count() == 4
        box = window.data("box")
        window.drag((140.0, 130.0), (150.0, 130.0))
        page.wait_for_selector(".pin.frame.moved")
        window.settled()
        assert window.data("box") != box
        moved = reruns.control(reruns.reloaded(engine.result().getroot()), "box").reshape(-1, 2)
        assert moved.min(axis=0) == pytest.approx([130.0, 100.0], abs=0.5)
        assert np.ptp(moved, axis=0) == pytest.approx([40.0, 60.0], abs=1e-3)


def test_keys_nudge_and_hold_to_an_axis(window: harness.Window) -> None:
    page = window.page
    with served(DRAWING) as (engine, server):
        window.open(server.address)
        set_pins(window, LEFT, TOP)
        window.settled()
        page.keyboard.press("Shift+ArrowUp")
        page.wait_for_selector(".pin.moved")
        window.settled()
        (x, y) = engine.state()["grips"][1]["now"][0]
        scale = window.at((1.0, 0.0))[0] - window.at((0.0, 0.0))[0]
        assert [x, y] == pytest.approx([TOP[0], TOP[1] - 10.0 / scale], abs=0.2)
        page.keyboard.down("Shift")
        window.drag((x, y), (x + 20.0, y - 3.0))
        page.keyboard.up("Shift")
        window.settled()
        assert engine.state()["grips"][1]["now"][0] == pytest.approx([x + 20.0, y], abs=0.5)
        # Tab reaches the pins, and says which it is.
        page.keyboard.press("Shift+Tab")
        assert page.evaluate("document.activeElement.getAttribute('aria-label')") == "Pin 1, holds its point"
        # Before and after.
        page.keyboard.down("b")
        assert page.is_visible("#original") and not page.is_visible("#now")
        page.keyboard.up("b")
        assert page.is_visible("#now")


def test_the_view_zooms_and_pins_keep_their_size(window: harness.Window) -> None:
    page = window.page
    with served(DRAWING) as (_engine, server):
        window.open(server.address)
        window.click(TOP)
        window.wait_for_pins(1)
        before = window.at(TOP)
        page.mouse.move(*before)
        page.mouse.wheel(0, -600)
        page.wait_for_timeout(50)
        # A mouse is at whole pixels, which are some when zoomed.
        assert window.at(TOP) == pytest.approx(before, abs=2.0)
        assert window.at((61.0, 20.0))[0] - window.at(TOP)[0] > 3.0
        box = page.locator(".pin").bounding_box()
        assert box["width"] == 24
        assert [box["x"] + 12, box["y"] + 12] == pytest.approx(window.at(TOP), abs=1.0)
        page.keyboard.down(" ")
        page.mouse.down()
        page.mouse.move(before[0] + 50, before[1] + 30)
        page.mouse.up()
        page.keyboard.up(" ")
        assert window.at(TOP) == pytest.approx((before[0] + 50, before[1] + 30), abs=3.0)


def test_a_finger_drags_too(browser: Any) -> None:
    context = browser.new_context(viewport={"width": 800, "height": 600}, has_touch=True)
    window = harness.Window(context.new_page())
    with served(DRAWING) as (engine, server):
        window.open(server.address)
        window.page.touchscreen.tap(*window.at(LEFT))
        window.wait_for_pins(1)
        session = context.new_cdp_session(window.page)
        x, y = window.at(TOP)

        def touch(kind: str, *points: tuple[float, float]) -> None:
            places = [{"x": px, "y": py} for px, py in points]
            session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": places})

        touch("touchStart", (x + 6, y))
        for n in range(1, 5):
            touch("touchMove", (x + 6, y - 5 * n))
        touch("touchEnd")
        window.page.wait_for_selector(".pin.moved")
        window.settled()
        assert engine.state()["grips"][1]["moved"]
        # Two of them move apart around a point: the view grows there, and nothing else is moved.
        grips = engine.state()["grips"]
        near, far = window.at((60.0, 100.0)), window.at((70.0, 100.0))
        (x, y) = near
        touch("touchStart", (x - 40, y))
        touch("touchStart", (x - 40, y), (x + 40, y))
        for n in range(1, 6):
            touch("touchMove", (x - 40 - 8 * n, y), (x + 40 + 8 * n, y))
        touch("touchEnd")
        assert window.at((60.0, 100.0)) == pytest.approx(near, abs=2.0)
        grown = (window.at((70.0, 100.0))[0] - near[0]) / (far[0] - near[0])
        assert grown == pytest.approx(2.0, abs=0.1)
        assert engine.state()["grips"] == grips
    context.close()


# Answers to one question come late.
_LATE = """
const real = window.fetch;
window.fetch = (url, options) => real(url, options).then((answer) =>
  url === "/drop" ? new Promise((resolve) => setTimeout(resolve, 500, answer)) : answer);
"""


def test_steps_are_shown_in_their_order(window: harness.Window) -> None:
    """A pin is let go of before the answer to its being set has come."""
    window.page.add_init_script(_LATE)
    with served(DRAWING) as (engine, server):
        window.open(server.address)
        window.click(TOP)
        window.wait_for_pins(1)
        window.page.keyboard.press("Delete")
        window.settled()
        assert engine.state()["grips"] == []
        window.page.wait_for_timeout(700)
        assert window.pins() == []


# --- what is regular ----------------------------------------------------------------------------

_LINES = """
() => [...document.querySelectorAll("#lines:not([hidden]) .line")].map((one) => one.getAttribute("d"))
"""


def test_what_is_regular_is_shown_on_request(window: harness.Window) -> None:
    page = window.page
    with served(etree.tostring(reruns.load(CART))) as (engine, server):
        window.open(server.address)
        page.wait_for_selector("#found:not([hidden])")
        assert page.inner_text("#said") == "2 circles, 2 rows, 4 parts alike, 4 lines"
        assert page.evaluate(_LINES) == []
        page.check("#shown")
        page.wait_for_selector("#lines:not([hidden])")
        for point in ((0.0, 0.0), (0.0, 120.0), (200.0, 120.0)):
            window.click(point)
        window.wait_for_pins(3)
        # It follows a drag, and has less to show where nothing is kept.
        before = page.evaluate(_LINES)
        window.drag((200.0, 0.0), (240.0, -30.0))
        window.settled()
        kept = page.evaluate(_LINES)
        assert kept[0] != before[0]
        page.uncheck("#kept")
        page.wait_for_function("() => document.documentElement.dataset.settled === 'false'")
        window.settled()
        assert not engine.state()["regular"]
        assert len(page.evaluate(_LINES)[0]) < len(kept[0])
        page.uncheck("#shown")
        page.wait_for_selector("#lines", state="hidden")
        assert page.evaluate(_LINES) == []


def test_where_nothing_is_regular_nothing_can_be_shown(window: harness.Window) -> None:
    with served(etree.tostring(reruns.load(FREE))) as (_engine, server):
        window.open(server.address)
        window.page.wait_for_selector("#found:not([hidden])")
        assert window.page.inner_text("#said") == "nothing was found"
        assert window.page.is_disabled("#shown") and window.page.is_disabled("#kept")


# --- the end ------------------------------------------------------------------------------------


def test_cancel_and_a_lost_page_leave_the_file(browser: Any, drawing: Path, tmp_path: Path) -> None:
    for way in ("cancel", "closed"):
        folder = tmp_path / way
        folder.mkdir()
        shutil.copyfile(drawing, folder / "out.svg")
        context = browser.new_context()
        window = harness.Window(context.new_page())
        with harness.effect(drawing, folder) as effect:
            window.open(effect.address)
            window.click(LEFT)
            window.wait_for_pins(1)
            window.drag(TOP, (60.0, 5.0))
            window.settled()
            if way == "cancel":
                window.page.click("#cancel")
            else:
                window.page.close()
            assert effect.end() == 0
            assert effect.words == ""
        context.close()
        assert (folder / "out.svg").read_bytes() == DRAWING
        assert drawing.read_bytes() == DRAWING


def test_a_killed_page_leaves_the_file(browser: Any, drawing: Path, tmp_path: Path) -> None:
    context = browser.new_context()
    with harness.effect(drawing, tmp_path) as effect:
        window = harness.Window(context.new_page())
        window.open(effect.address)
        window.click(TOP)
        window.wait_for_pins(1)
        with pytest.raises(Exception, match=r"crash"):
            window.page.goto("chrome://crash")
        assert effect.end() == 0
        assert effect.words == ""
    context.close()
    assert not effect.output.exists()


def test_a_page_that_is_loaded_anew_goes_on(window: harness.Window) -> None:
    with served(DRAWING) as (_engine, server):
        window.open(server.address)
        window.click(TOP)
        window.wait_for_pins(1)
        window.page.reload()
        window.page.wait_for_selector("html[data-ready]")
        window.wait_for_pins(1)


# --- safety -------------------------------------------------------------------------------------


class Trap(http.server.BaseHTTPRequestHandler):
    """Another origin of this machine; remembers who asks."""

    asked: list[str]

    def do_GET(self) -> None:
        self.asked.append(self.path)
        body = b"<!DOCTYPE html><title>elsewhere</title>"
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_args: Any) -> None:
        """Not a word."""


@pytest.fixture
def trap() -> Iterator[tuple[str, list[str]]]:
    """An address, and what was asked of it."""
    asked: list[str] = []
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), type("One", (Trap,), {"asked": asked}))
    thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{server.server_address[1]}/", asked
    server.shutdown()
    server.server_close()


def test_hostile_drawings_run_and_load_nothing(browser: Any, trap: tuple[str, list[str]]) -> None:
    address, asked = trap
    assert len(hostile.WAYS) >= 20
    for way in hostile.WAYS:
        data = hostile.drawing(way, address)
        context = browser.new_context(viewport={"width": 600, "height": 500})
        page = context.new_page()
        requests: list[str] = []
        page.on("request", lambda request, found=requests: found.append(request.url))
        window = harness.Window(page)
        with served(data) as (engine, server):
            window.open(server.address)
            window.click((30.0, 25.0))
            window.wait_for_pins(1)
            page.mouse.click(*window.at((4.0, 4.0)))
            window.drag((70.0, 25.0), (74.0, 20.0))
            window.settled()
            assert page.evaluate("[window.ran, window.top.ran]") == [None, None], way
            assert all(url.startswith((server.origin, "data:image/")) for url in requests), way
            assert page.is_visible("header") and page.is_visible("#stage"), way
            new = engine.result().getroot()
        # What was hostile is in the file as it was.
        assert _hostile(new, address) == _hostile(loading.parse(data).getroot(), address), way
        context.close()
    assert asked == []


def _hostile(svg: Any, address: str) -> list[str]:
    """Tags, attributes and texts that are no part of a plain drawing, sorted."""
    found = []
    for element in svg.iter():
        texts = [f"{name}={value}" for name, value in element.attrib.items()] + [element.text or ""]
        found += [text for text in texts if address in text or "ran" in text.replace("transform", "")]
        if isinstance(element.tag, str) and etree.QName(element).localname not in shown.ELEMENTS:
            found.append(element.tag)
    return sorted(found)


def test_another_origin_is_refused(browser: Any, trap: tuple[str, list[str]]) -> None:
    """A page from elsewhere in the same browser, which even knows the key."""
    address, _asked = trap
    context = browser.new_context()
    with served(DRAWING) as (engine, server):
        window = harness.Window(context.new_page())
        window.open(server.address)
        page = context.new_page()
        page.goto(address)
        script = """
        async ([url, key]) => {
          const headers = {"Content-Type": "application/json", "X-Alup-Key": key};
          const body = '{"at":[60,20],"reach":5}';
          const tries = [
            () => fetch(url + "/press", {method: "POST", headers, body}).then((r) => r.text()),
            () => fetch(url + "/press", {method: "POST", mode: "no-cors", body}).then((r) => r.text()),
            () => fetch(url + "/open", {method: "POST", headers, body: "{}"}).then((r) => r.text()),
            () => fetch(url + "/", {}).then((r) => r.text()),
            () => import(url + "/main.js").then(() => "imported"),
          ];
          return Promise.all(tries.map((one) => one().catch(() => "refused")));
        }"""
        found = page.evaluate(script, [server.origin, server.key])
        assert set(found) <= {"refused", ""}
        frame = """
        (url) => new Promise((resolve) => {
          const frame = document.createElement("iframe");
          frame.src = url;
          frame.onload = () => { try { resolve(frame.contentDocument?.title ?? "closed") }
                                 catch { resolve("closed") } };
          document.body.append(frame);
        })"""
        assert page.evaluate(frame, server.origin + "/") == "closed"
        assert engine.state()["grips"] == []
        window.click(TOP)
        window.wait_for_pins(1)
    context.close()


# --- language -----------------------------------------------------------------------------------


def test_it_speaks_german(window: harness.Window, drawing: Path, tmp_path: Path) -> None:
    with harness.effect(drawing, tmp_path, LANGUAGE="de", LANG="de_DE.UTF-8") as effect:
        window.open(effect.address)
        page = window.page
        assert page.inner_text("#done") == "Fertig"
        assert page.get_attribute("html", "lang") == "de"
        assert "Haltepunkt" in page.inner_text("#first")
        page.wait_for_selector("#found:not([hidden])")
        assert page.inner_text("#found").split() == ["Regelmäßiges:", "erhalten", "zeigen", "10", "Linien"]
        window.click(TOP)
        window.wait_for_pins(1)
        assert page.get_attribute(".pin", "aria-label") == "Haltepunkt 1, hält seinen Punkt"
        page.click("#cancel")
        assert effect.end() == 0


# --- without a browser --------------------------------------------------------------------------


def test_without_a_browser_a_sentence_says_so(drawing: Path, tmp_path: Path) -> None:
    output = tmp_path / "o.svg"
    environment = {name: value for name, value in os.environ.items() if "DISPLAY" not in name}
    for more in ({}, {"ALUP_BROWSER": "/does/not/exist"}, {"ALUP_BROWSER": "false"}):
        done = subprocess.run(
            [
                sys.executable,
                str(harness.ROOT / "alup_live.py"),
                f"--output={output}",
                str(drawing),
            ],
            env={**environment, "LANGUAGE": "en", **more},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert done.returncode != 0
        assert done.stdout == ""
        assert done.stderr.startswith("No browser has opened the window; nothing was changed.")
        assert "Traceback" not in done.stderr
        assert not output.exists()
