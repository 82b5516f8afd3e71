# SPDX-License-Identifier: GPL-2.0-or-later
"""The sweep over folders of drawings: its handles, its verdicts, and that its checks can fail."""

from __future__ import annotations

import copy
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Callable

import clipart
import numpy as np
import polib
import pytest
import sweep
import sweep_check
import sweep_handles
import sweep_lasting
import sweep_process
import sweep_verdict
from lxml import etree

from alup.svg import path_data

ROOT = Path(__file__).resolve().parents[1]
DATA = clipart.DRAWINGS
HEAD = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">'
DRAWING = (
    HEAD
    + """<title>A test</title>
<defs><linearGradient id="paint" gradientUnits="userSpaceOnUse" x1="0" x2="90">
<stop id="stop"/></linearGradient></defs>
<g id="group" style="fill:red"><path id="one" d="M10,10 C30,0 60,0 80,10 L80,60 L10,60 Z M20,20 h9 v9 z"
 style="fill:url(#paint);stroke:blue"/><rect id="two" x="30" y="30" width="20" height="20" fill="green"/></g>
<path id="beside" d="M90,10 V60 L95,40 Z" fill="url(#paint)"/>
<text id="words" x="20" y="50">Hello</text></svg>"""
)


def job(path: Path, kind: str = "stretch", seed: int = 0) -> sweep.Job:
    return sweep.Job(path, f"test/{path.name}", kind, seed)


def examined(
    folder: Path, text: str | bytes, effect: Callable[[list[str]], None] | None = None, **settings: Any
) -> dict[str, Any]:
    """One drawing, in a process of its own."""
    path, own = folder / "drawing.svg", folder / "own"
    own.mkdir()
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return sweep.examine(job(path), own, sweep_verdict.Settings(**settings), effect)


# --- a folder ------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, str]:
    """A folder, the results of a sweep of it, and what was printed."""
    folder = tmp_path_factory.mktemp("sweep")
    files = folder / "files"
    (files / "deeper").mkdir(parents=True)
    for name in ("oca-mug", "flat-full_battery"):
        shutil.copy(DATA / f"{name}.svg", files / "deeper")
    (files / "link.svg").symlink_to(files / "deeper" / "oca-mug.svg")
    (files / "words.svg").write_text(HEAD + '<text x="9" y="9">Hello</text></svg>')
    (files / "unclosed.svg").write_text(
        HEAD + '<g><path d="M10,10 H60 V70 H10 Z"/><rect width="9" height="9">'
    )
    (files / "bad-number.svg").write_text(HEAD + '<path id="bad" d="M10,10 L20,2x"/></svg>')
    (files / "empty.svg").write_text("")
    results = folder / "results.jsonl"
    return files, results, run(results, "--jobs=2", "--each=1", str(files))


def run(results: Path, *arguments: str) -> str:
    command = [sys.executable, str(ROOT / "benchmarks" / "sweep.py"), f"--results={results}", *arguments]
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONWARNINGS")}
    done = subprocess.run(command, capture_output=True, text=True, timeout=200, env=environment)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Traceback" not in done.stderr, done.stderr
    return done.stdout


def outcomes(results: Path) -> dict[str, str]:
    return {one["file"].split("/")[-1]: one["outcome"] for one in sweep.read_results(results)}


def test_every_file_of_a_folder_ends_as_it_should(swept: tuple[Path, Path, str]) -> None:
    _, results, _ = swept
    found = outcomes(results)
    assert found == {
        "oca-mug.svg": "reshaped",
        "flat-full_battery.svg": "reshaped",
        "unclosed.svg": "reshaped",
        "words.svg": "no geometry",
        "bad-number.svg": "refused",
        "empty.svg": "unreadable",
    }


def test_the_summary_counts_what_was_found(swept: tuple[Path, Path, str]) -> None:
    _, results, printed = swept
    assert re.search(r"^reshaped +3 ", printed, re.MULTILINE)
    assert re.search(r"^no geometry +1 ", printed, re.MULTILINE)
    assert "refused, of files with geometry: 1 of 4 (25.00 %)" in printed
    assert "{name}: its path data can't be read" in printed
    assert "bad" not in printed.replace("bad-number.svg", "")  # names are left out of reasons
    assert run(results, "--summary") == printed


def test_a_sweep_resumes_where_it_was_ended(swept: tuple[Path, Path, str]) -> None:
    files, results, _ = swept
    before = results.read_text()
    run(results, "--each=1", str(files))
    assert results.read_text() == before
    cut = before.rstrip("\n")[:-20]  # as if the sweep was ended in the middle of a line
    results.write_text(cut)
    run(results, "--each=1", str(files))
    assert outcomes(results) == {
        one["file"].split("/")[-1]: one["outcome"] for one in map(json.loads, before.split("\n")[:-1])
    }
    lines = len(results.read_text().split("\n"))
    run(results, "--each=1", "--again=no geometry", str(files))
    assert len(results.read_text().split("\n")) == lines + 1
    assert sweep.read_results(results)[-1]["file"] == "files/words.svg"


def test_every_file_comes_first_with_a_kind_of_its_own_and_links_do_not_count(
    swept: tuple[Path, Path, str],
) -> None:
    files, _, _ = swept
    kinds = list(sweep_handles.KINDS)
    jobs = sweep.jobs_of([files], kinds, 3, 0)
    assert len(jobs) == 3 * 6
    assert len({one.identity for one in jobs}) == 18
    assert len({one.path for one in jobs[:6]}) == 6
    assert len({one.kind for one in jobs[:6]}) > 1
    assert jobs == sweep.jobs_of([files], kinds, 3, 0)
    assert jobs != sweep.jobs_of([files], kinds, 3, 1)
    assert len(sweep.jobs_of([files], kinds, 1, 0, sample=2)) == 2


# --- the handles ---------------------------------------------------------------------------------

SQUARE = path_data.parse("M10,20 H50 V80 H10 Z")[0].control


def sides(found: list[sweep_handles.Wish]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sources and targets of those that move, and the pins."""
    moving = [wish for wish in found if not np.array_equal(wish.source, wish.target)]
    pins = [wish.source for wish in found if np.array_equal(wish.source, wish.target)]
    return np.array([w.source for w in moving]), np.array([w.target for w in moving]), np.array(pins)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(("kind", "factor"), [("stretch", 1.3), ("compress", 0.3)])
def test_one_side_moves_and_the_opposite_one_stays(kind: str, factor: float, seed: int) -> None:
    sources, targets, pins = sides(sweep_handles.wishes(SQUARE, kind, np.random.default_rng(seed)))
    assert len(sources) == len(pins) == 2
    axis = int(np.argmax(np.abs(targets[0] - sources[0])))
    assert np.ptp(sources[:, axis]) == np.ptp(pins[:, axis]) == 0.0
    before, after = sources[0, axis] - pins[0, axis], targets[0, axis] - pins[0, axis]
    assert abs(before) == (40.0, 60.0)[axis]
    assert after == pytest.approx(factor * before)
    np.testing.assert_array_equal(sources[:, 1 - axis], targets[:, 1 - axis])


@pytest.mark.parametrize("seed", range(6))
def test_one_point_moves_and_the_other_sides_stay(seed: int) -> None:
    rhombus = path_data.parse("M10,50 L30,20 L50,50 L30,80 Z")[0].control
    sources, targets, pins = sides(sweep_handles.wishes(rhombus, "point", np.random.default_rng(seed)))
    assert len(sources) == 1
    assert np.hypot(*(targets - sources)[0]) == pytest.approx(0.15 * np.hypot(40.0, 60.0))
    assert len(pins) == 3
    held = {tuple(point) for point in [*sources, *pins]}
    assert held == {tuple(corner) for corner in rhombus[:, 0]}


def test_curves_without_extent_get_no_handle() -> None:
    rng = np.random.default_rng(0)
    assert sweep_handles.wishes(np.ones((1, 4, 2)), "point", rng) == []
    assert sweep_handles.wishes(np.zeros((0, 4, 2)), "point", rng) == []


def prepared(kind: str = "stretch", seed: int = 0, text: str = DRAWING) -> sweep_handles.Prepared:
    svg = etree.fromstring(text)
    folder = Path(os.environ.get("TMPDIR", "/tmp")) / f"sweep-{os.getpid()}.svg"
    folder.write_bytes(etree.tostring(svg))
    try:
        loaded = sweep_handles.load(folder)
    finally:
        folder.unlink()
    return sweep_handles.prepare(loaded, kind, sweep_handles.random_of("test", seed))


def test_preparing_names_everything_and_counts_what_is_drawn() -> None:
    case = prepared()
    assert all(element.get("id") for element in case.svg.iter(etree.Element))
    assert case.content == {"path": 2, "rect": 1, "text": 1}
    hidden = DRAWING.replace('id="group" style="', 'id="group" style="display:none;')
    assert prepared(text=hidden).content == {"path": 1, "text": 1}


def test_all_ways_to_select_are_tried_and_never_a_handle() -> None:
    cases = [prepared(seed=seed) for seed in range(30)]
    assert {case.scope for case in cases} == {"drawing", "shapes", "group"}
    order = [element.get("id") for element in cases[0].svg.iter()]
    for case in cases:
        taken = {order[n] for n in case.affected}
        if case.scope == "drawing":
            assert (case.ids, taken) == ([], {"one", "two", "beside", "words"})
        elif case.scope == "group":
            assert (case.ids, taken) == (["group"], {"one", "two"})
        else:
            assert set(case.ids) == taken < {"one", "two", "beside"}


def test_a_selection_without_length_is_not_taken() -> None:
    text = HEAD + '<path id="point" d="M5,5"/><path id="line" d="M10,10 H60 V70 Z"/></svg>'
    cases = [prepared(seed=seed, text=text) for seed in range(30)]
    assert all(case.ids in ([], ["line"]) for case in cases)
    assert all(len(case.wishes) >= 2 for case in cases)


# --- the process ---------------------------------------------------------------------------------


def test_a_good_run_is_verified(tmp_path: Path) -> None:
    found = examined(tmp_path, DRAWING)
    assert found["outcome"] == "reshaped", found
    assert found["missed"] < sweep_check.HANDLES_WITHIN
    assert found["changed"] > 0
    assert 0.0 < found["cpu"] <= found["seconds"] + 0.5


def test_the_output_of_a_run_is_stable(tmp_path: Path) -> None:
    found = examined(tmp_path, DRAWING, lasting=1.0)
    assert (found["outcome"], found["lasting"]) == ("reshaped", [])


def test_an_output_that_is_not_stable_is_seen(tmp_path: Path) -> None:
    """A different input, a handle that was moved after the run, and an output that is no drawing."""
    examined(tmp_path, DRAWING)
    own, limits = tmp_path / "own", (60.0, 4000)
    before, after = (own / name for name in ("in.svg", "out.svg"))
    given, written = before.read_bytes(), after.read_bytes()
    assert sweep_lasting.faults(own, [], *limits) == []
    before.write_bytes(given.replace(b"M20,20", b"M20,21"))
    assert sweep_lasting.faults(own, [], *limits) == [
        f"lasting: {sweep_lasting.RESTORED} is another document"
    ]
    before.write_bytes(given)
    moved = re.sub(rb'(alup:to 0"[^>]* cx=")([^"]+)', lambda m: m[1] + b"%f" % (float(m[2]) + 3.0), written)
    after.write_bytes(moved)
    assert sweep_lasting.faults(own, [], *limits) == [f"lasting: {sweep_lasting.AGAIN} is another document"]
    after.write_bytes(written[:-9])
    assert [" did not end well: " in fault for fault in sweep_lasting.faults(own, [], *limits)] == [
        True,
        True,
    ]


def says(text: str, code: int = 1) -> Callable[[list[str]], None]:
    def effect(_: list[str]) -> None:
        sys.stderr.write(text)
        raise SystemExit(code)

    return effect


def prints(text: bytes) -> Callable[[list[str]], None]:
    def effect(_: list[str]) -> None:
        sys.stdout.buffer.write(text)

    return effect


def echoes(words: list[str]) -> None:
    sys.stdout.buffer.write(Path(words[-1]).read_bytes())


def fails(_: list[str]) -> None:
    raise ZeroDivisionError("one over nothing")


def takes_memory(_: list[str]) -> None:
    np.ones(2 * 10**9)


def warns(words: list[str]) -> None:
    echoes(words)
    sys.stderr.write("RuntimeWarning: overflow")


@pytest.mark.parametrize(
    ("effect", "outcome", "reason"),
    [
        (says("The handle x has no size. Delete it and draw a circle instead."), "refused", "The handle {n"),
        (says("Something is wrong.\n"), "foreign message", "Something is wrong"),
        (says(""), "foreign message", "exit code 1 alone"),
        (fails, "traceback", "ZeroDivisionError: one over nothing"),
        (takes_memory, "traceback", "MemoryError"),
        (prints(b""), "no-op", "no document"),
        (echoes, "no-op", "nothing moved"),
        (prints(b"<svg/>x"), "stray output", "no XML"),
        (prints(b" \n<svg/>"), "stray output", "beside"),
        (warns, "stray output", "RuntimeWarning"),
        (lambda _: os.kill(os.getpid(), signal.SIGKILL), "signal", "SIGKILL"),
        (lambda _: time.sleep(60), "hang", "not done after 0.2 s of"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)  # fmt: skip
def test_how_a_run_ended_is_seen(
    tmp_path: Path, effect: Callable[[list[str]], None], outcome: str, reason: str
) -> None:
    limits = {"limit": 0.2} if outcome == "hang" else {"megabytes": 4000}
    found = examined(tmp_path, DRAWING, effect, **limits)
    assert found["outcome"] == outcome, found
    assert reason in found["reason"]


def test_the_files_of_a_defect_are_kept(tmp_path: Path) -> None:
    examined(tmp_path, DRAWING, fails, keep=tmp_path / "kept")
    (folder,) = (tmp_path / "kept" / "traceback").iterdir()
    assert {"in.svg", "run.json", "stderr"} <= {path.name for path in folder.iterdir()}


def test_processes_of_a_run_end_with_it(tmp_path: Path) -> None:
    def leaves_one(_: list[str]) -> None:
        if os.fork() == 0:
            time.sleep(60)

    began = time.monotonic()
    sweep_process.run(lambda: leaves_one([]), tmp_path, 5.0, 4000)
    assert time.monotonic() - began < 5.0


# --- the sentences -------------------------------------------------------------------------------

MESSAGES = [entry.msgid for entry in polib.pofile(str(ROOT / "locale" / "alup-reshape.pot"))]


def test_every_message_of_ours_is_recognised_whatever_names_are_in_it() -> None:
    field = re.compile(r"\{(\w+)(?:![rs])?(?::[^}]*)?\}")
    sentences = [message for message in MESSAGES if message.rstrip(")\u201d").endswith(".")]
    assert len(sentences) > 50
    for message in sentences:
        # In "{name}: {why}." only the reason tells that the message is ours.
        filled = message.replace("{why}", "a drawing inside the drawing; ungroup it")
        found = sweep_verdict.template_of(field.sub("a (strange. name)", filled))
        assert found is not None, message
        if not {"what", "why"} & set(field.findall(message)):
            assert field.sub("", found) == field.sub("", message)


@pytest.mark.parametrize("text", ["", "Killed", "KeyError: 3", "p1: a reason.", "The drawing is fine."])
def test_other_texts_are_no_messages_of_ours(text: str) -> None:
    assert sweep_verdict.template_of(text) is None


def test_a_message_within_a_message_tells_what_it_was() -> None:
    said = "p1: its list of points ends in half a point. Correct it in the XML editor or delete the object."
    assert sweep_verdict.template_of(said) == "{name}" + said[2:]


# --- the comparison can fail ---------------------------------------------------------------------


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, Any, sweep_handles.Prepared]:
    """A drawing of which a group was reshaped, before and after."""
    import alup_reshape

    case = next(c for c in (prepared(seed=seed) for seed in range(30)) if c.scope == "group")
    folder = tmp_path_factory.mktemp("good")
    case.svg.getroottree().write(str(folder / "in.svg"))
    alup_reshape.AlupReshape().run(["--id=group", f"--output={folder / 'out.svg'}", str(folder / "in.svg")])
    before, after = (sweep_check.parse((folder / name).read_bytes()) for name in ("in.svg", "out.svg"))
    return before, after, case


def compared(
    good: tuple[Any, Any, sweep_handles.Prepared], tamper: Callable[[Any], None]
) -> sweep_check.Found:
    before, after, case = good
    after = copy.deepcopy(after)
    tamper(after)
    after = sweep_check.parse(etree.tostring(after))
    return sweep_check.compare(before, after, case.affected, case.wishes)


def at(root: Any, identity: str) -> Any:
    (found,) = root.xpath(f"//*[@id='{identity}']")
    return found


def test_a_good_output_has_no_faults(good: tuple[Any, Any, sweep_handles.Prepared]) -> None:
    found = compared(good, lambda _: None)
    assert found.faults == []
    assert found.changed == 2
    assert found.missed < sweep_check.HANDLES_WITHIN
    # The group's paint also paints what is beside it, so that a copy was made.
    assert at(good[1], "one").get("style") != at(good[0], "one").get("style")


@pytest.mark.parametrize("where", ["a layer made for them", "the root"])
def test_notes_are_no_fault(good: tuple[Any, Any, sweep_handles.Prepared], where: str) -> None:
    space = 'xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" xmlns="http://www.w3.org/2000/svg"'
    group = f'<g {space} inkscape:label="alup:notes"><text id="n"><tspan id="l">word</tspan></text></g>'
    layer = f'<g {space} id="layer" inkscape:label="ALUP handles">{{}}</g>'
    text = layer.format(group) if where == "a layer made for them" else group
    assert compared(good, lambda root: root.append(etree.fromstring(text))).faults == []
    others = layer.format(group + '<rect id="z"/>')
    assert compared(good, lambda root: root.append(etree.fromstring(others))).faults != []


def test_only_namespaces_may_be_wrong() -> None:
    body = b'<svg xmlns="http://www.w3.org/2000/svg" xmlns:x="%s"><g x:a="1"/></svg>'
    assert sweep_check.parse(body % b"&amp;ns_xlink;")[0].attrib
    for damaged in (
        body[:-2] % b"a",
        body % b"a" + b"x",
        body % b"&ns;",
        body.replace(b"<g ", b"<g x:a='2' ") % b"a",
    ):
        with pytest.raises(etree.XMLSyntaxError):
            sweep_check.parse(damaged)


def test_nothing_changed_is_seen(good: tuple[Any, Any, sweep_handles.Prepared]) -> None:
    found = sweep_check.compare(good[0], copy.deepcopy(good[0]), good[2].affected, [])
    assert (found.faults, found.changed) == ([], 0)


def swap(root: Any) -> None:
    group = at(root, "group")
    group.append(group[0])


def set_to(identity: str, name: str, value: str) -> Callable[[Any], None]:
    return lambda root: at(root, identity).set(name, value)


def elsewhere(identity: str, pattern: str, replacement: str, name: str = "d") -> Callable[[Any], None]:
    def tamper(root: Any) -> None:
        element = at(root, identity)
        assert re.search(pattern, element.get(name)), element.get(name)
        element.set(name, re.sub(pattern, replacement, element.get(name), count=1))

    return tamper


def shift_all(root: Any) -> None:
    for identity in ("one", "two"):
        data = at(root, identity).get("d")
        at(root, identity).set("d", re.sub(r"([-\d.]+),", lambda m: f"{float(m[1]) + 0.5},", data))


def rename(root: Any) -> None:
    at(root, "two").tag = "{http://www.w3.org/2000/svg}polygon"


def say(text: str) -> Callable[[Any], None]:
    def tamper(root: Any) -> None:
        at(root, "words").text = text

    return tamper


@pytest.mark.parametrize(
    ("kind", "tamper"),
    [
        ("ids", set_to("one", "id", "won")),
        ("ids", swap),
        ("elements", lambda root: at(root, "beside").getparent().remove(at(root, "beside"))),
        ("elements", lambda root: etree.SubElement(root, "{http://www.w3.org/2000/svg}path", id="new")),
        ("elements", say("Goodbye")),
        ("elements", rename),
        ("not finite", elsewhere("one", r"C [-\d.]+,", "C nan,")),
        ("not finite", elsewhere("two", r"M [-\d.]+,", "M inf,")),
        ("styles", elsewhere("one", "stroke:blue", "stroke:red", "style")),
        ("styles", elsewhere("one", r"#[\w-]+", "#stop", "style")),
        ("styles", set_to("two", "fill", "red")),
        ("outside", set_to("group", "style", "fill:green")),
        ("attributes", set_to("one", "transform", "translate(1,1)")),
        ("outside", set_to("beside", "d", "M90,10 V60 L95,41 Z")),
        ("outside", set_to("words", "x", "21")),
        ("outside", set_to("paint", "gradientTransform", "scale(2)")),
        ("outside", set_to("stop", "offset", "1")),
        ("outside", set_to("beside", "style", "fill:red")),
        ("curves", elsewhere("one", r"Z( M.*)", r"\1")),
        ("curves", elsewhere("one", r" M.*", "")),
        ("curves", elsewhere("two", r" L [^L]*", "")),
        ("handle", shift_all),
    ],
)
def test_the_comparison_sees_every_kind_of_fault(
    good: tuple[Any, Any, sweep_handles.Prepared], kind: str, tamper: Callable[[Any], None]
) -> None:
    faults = compared(good, tamper).faults
    assert faults
    assert {fault.split(":")[0] for fault in faults} & {kind}, faults


def test_growth_beyond_the_bounds_is_measured(good: tuple[Any, Any, sweep_handles.Prepared]) -> None:
    assert compared(good, lambda _: None).growth < 0.2
    assert compared(good, elsewhere("one", r"C [-\d.]+,", "C 900,")).growth > 5.0


def test_a_file_that_no_program_draws_is_seen(tmp_path: Path) -> None:
    (tmp_path / "in.svg").write_text(DRAWING)
    (tmp_path / "out.svg").write_text(DRAWING[:-6])
    faults = sweep_verdict._drawing_faults(sweep_verdict.rsvg_command, tmp_path / "in.svg", tmp_path)
    assert faults == ["drawing: rsvg-convert can't draw it"]
    (tmp_path / "out.svg").write_text(DRAWING)
    assert sweep_verdict._drawing_faults(sweep_verdict.rsvg_command, tmp_path / "in.svg", tmp_path) == []


def test_ending_a_sweep_ends_its_runs(tmp_path: Path) -> None:
    files = tmp_path / "files"
    files.mkdir()
    for n in range(20):
        shutil.copy(DATA / "oca-contour_elephant.svg", files / f"{n}.svg")
    results = tmp_path / "results.jsonl"
    command = [sys.executable, str(ROOT / "benchmarks" / "sweep.py"), f"--results={results}", str(files)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as sweeping:
        until = time.monotonic() + 60.0
        while time.monotonic() < until and not (results.exists() and results.read_bytes()):
            time.sleep(0.05)
        sweeping.terminate()
        # The pipe ends with the last process that holds it.
        said = sweeping.communicate(timeout=10.0)[0]
    assert b"KeyboardInterrupt" in said
    assert 0 < len(sweep.read_results(results)) < 60
