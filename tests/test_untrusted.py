# SPDX-License-Identifier: GPL-2.0-or-later
"""Malicious drawings: nothing is fetched, multiplied, run, or shown as something else."""

# XML is read more easily on one line.
# ruff: noqa: E501

from __future__ import annotations

import ast
import gzip
import http.server
import json
import os
import re
import resource
import stat
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Iterator
from xml.sax.saxutils import quoteattr

import pytest
from builders import BLOB
from test_effect import HANDLES, HEAD, PATH, SCRIPT, QuickRun, Run, circle
from test_faults import GIB, Case, limit

from alup import startup
from alup.document import effect
from alup.document.tree import css, loading, references
from alup.messages.errors import LONGEST_MESSAGE, AlupError, DocumentError

ROOT = SCRIPT.parent


def drawing(body: str = "", doctype: str = "") -> str:
    return f'<?xml version="1.0"?>\n{doctype}{HEAD}{body}{PATH}{HANDLES}</svg>'


# --- entities -----------------------------------------------------------------------------------


@pytest.fixture
def server() -> Iterator[tuple[str, list[str]]]:
    """An address, and what has been asked for there."""
    asked: list[str] = []

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            asked.append(self.path)
            self.send_response(200)
            self.end_headers()
            self.wfile.write(b'<!ENTITY y "SECRET">')

        def log_message(self, *_: object) -> None:
            pass

    with http.server.HTTPServer(("127.0.0.1", 0), Handler) as running:
        thread = threading.Thread(target=running.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{running.server_port}", asked
        running.shutdown()
        thread.join()


OUTSIDE = {
    "a file": '<!DOCTYPE svg [<!ENTITY y SYSTEM "file://{folder}/secret.txt">]>',
    "a file beside": '<!DOCTYPE svg [<!ENTITY y SYSTEM "secret.txt">]>',
    "an address": '<!DOCTYPE svg [<!ENTITY y SYSTEM "{address}/y">]>',
    "a definition": '<!DOCTYPE svg SYSTEM "file://{folder}/secret.dtd">',
    "a definition elsewhere": '<!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" "{address}/svg11.dtd">',
    "a parameter": '<!DOCTYPE svg [<!ENTITY % p SYSTEM "file://{folder}/secret.dtd"> %p;]>',
    "a parameter elsewhere": '<!DOCTYPE svg [<!ENTITY % p SYSTEM "{address}/p"> %p;]>',
    "a parameter in a parameter": """<!DOCTYPE svg [<!ENTITY % q "<!ENTITY &#37; p SYSTEM 'file://{folder}/secret.dtd'>"> %q; %p;]>""",
}


@pytest.mark.parametrize("doctype", OUTSIDE.values(), ids=OUTSIDE.keys())
def test_external_entities_are_not_read(
    doctype: str, server: tuple[str, list[str]], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    address, asked = server
    (tmp_path / "secret.txt").write_text("SECRET")
    (tmp_path / "secret.dtd").write_text('<!ENTITY y "SECRET">')
    doctype = doctype.format(folder=tmp_path, address=address)
    run = QuickRun(tmp_path, drawing('<text id="t">&y;</text>', doctype), capture=capfd)
    assert asked == []
    assert "SECRET" not in run.stdout + run.stderr
    if run.code:  # older versions of the library don't know the entity then
        run.assert_refused("can't be read", "'y'")
    else:
        run.figures()
        text = run.output.read_text()
        assert "SECRET" not in text
        assert ">&y;</text>" in text  # as it was
        assert doctype.split("[")[0].split(" PUBLIC")[0] in text


def test_entities_within_the_file_stay_and_mean_what_they_did(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """As Illustrator writes them."""
    doctype = '<!DOCTYPE svg [<!ENTITY ns_svg "http://www.w3.org/2000/svg"><!ENTITY ten "10">]>'
    body = f'<text id="t">&ten;</text><path id="q" stroke-width="&ten;" d="{BLOB}"/>'
    text = drawing(body, doctype).replace('xmlns="http://www.w3.org/2000/svg"', 'xmlns="&ns_svg;"')
    run = QuickRun(tmp_path, text, capture=capfd)
    run.figures()
    assert run.element("q").get("stroke-width") == "10"
    assert run.element("q").get("d") == run.element("p").get("d") != BLOB
    assert ">&ten;</text>" in run.output.read_text()


def bomb(levels: int, each: int, inner: str = "lol" * 30) -> str:
    """Entities that become each**levels times the inner text."""
    names = [f"e{n}" for n in range(levels + 1)]
    nested = [f'<!ENTITY {b} "{f"&{a};" * each}">' for a, b in zip(names, names[1:])]
    return f'<!DOCTYPE svg [<!ENTITY e0 "{inner}">{"".join(nested)}]>'


BOMBS = {
    "in a text": drawing('<text id="t">&e8;</text>', bomb(8, 20)),
    "in an attribute": drawing('<text id="t" x="&e8;"/>', bomb(8, 20)),
    "in a style": drawing("<style>&e8;</style>", bomb(8, 20)),
    "of one level": drawing(f'<text id="t" x="{"&e0;" * 20_000}"/>', bomb(0, 0, "x" * 100_000)),
    "of itself": drawing(
        '<text id="t" x="&e0;"/>', '<!DOCTYPE svg [<!ENTITY e0 "&e1;"><!ENTITY e1 "&e0;">]>'
    ),
    "of a parameter": drawing("", '<!DOCTYPE svg [<!ENTITY % a "<!-- %a; -->"> %a;]>'),
    "never used": drawing("", bomb(8, 20)),
}


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "utf-7"])
@pytest.mark.parametrize("name", BOMBS)
def test_entities_that_multiply(name: str, encoding: str, tmp_path: Path) -> None:
    """In any encoding: files that may hold entities are guarded, too."""
    text = BOMBS[name].replace('version="1.0"', f'version="1.0" encoding="{encoding}"')
    # UTF-7 can encode < and &, which hides them from a search of the bytes.
    data = text.replace("<!", "+ADwAIQ-").encode("ascii") if encoding == "utf-7" else text.encode(encoding)
    file = tmp_path / "bomb.svg"
    file.write_bytes(data)
    program = (
        "import sys; from pathlib import Path\n"
        "from alup.document.tree.loading import parse; from alup.messages.errors import DocumentError\n"
        "from lxml import etree\n"
        "try:\n    whole = etree.tostring(parse(Path(sys.argv[1]).read_bytes()))\n"
        "except DocumentError as error:\n    whole = str(error).encode()\n"
        "sys.stdout.buffer.write(whole[:100_000])\n"
    )
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [sys.executable, "-c", program, str(file)],
        cwd=ROOT,
        capture_output=True,
        preexec_fn=limit(resource.RLIMIT_AS, GIB // 2),
        timeout=60,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert (done.returncode, done.stderr) == (0, b"")
    assert len(done.stdout) <= 2 * len(data)
    assert after.ru_utime - before.ru_utime < 5.0


@pytest.mark.parametrize("always", [True, False])
def test_a_large_text_beside_entities(always: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the guard of older versions costs, and that it is on."""
    if always and not loading.GUARDED_ANYWAY:
        pytest.skip("this version of libxml2 is an older one")
    monkeypatch.setattr(loading, "GUARDED_ANYWAY", always)
    text = "x" * 10_100_000
    data = drawing(f"<desc>{text}</desc>", bomb(1, 2)).encode()
    if always:
        assert loading.parse(data).findtext("{*}desc") == text
    else:
        with pytest.raises(DocumentError, match="can't be read"):
            loading.parse(data)


def test_where_entities_may_be_the_guard_is_on() -> None:
    """Newer versions of libxml2 always have it on, so the tests with bombs would not show it."""
    for encoding in ("utf-8", "UTF-8", "us-ascii", "iso-8859-15", "windows-1252"):
        plain = drawing("ü").replace('version="1.0"', f"version='1.0' encoding = '{encoding}'")
        assert not loading._may_declare_entities(plain.encode(encoding, "xmlcharrefreplace"))
        assert loading._may_declare_entities(bomb(1, 2).encode(encoding))
    for hiding in ("utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-8-sig"):
        assert loading._may_declare_entities(drawing("", bomb(1, 2)).encode(hiding))
    for unknown in ("utf-7", "IBM037", "utf-16", "x-none"):
        declared = drawing().replace('version="1.0"', f'version="1.0" encoding="{unknown}"').encode()
        assert loading._may_declare_entities(declared)
        assert loading._may_declare_entities(b"\xef\xbb\xbf \n" + declared)


# --- damage -------------------------------------------------------------------------------------


@pytest.mark.parametrize("part", [0.0, 0.3, 0.6, 0.9, 0.999])
def test_a_truncated_file_is_not_taken_for_a_whole_one(
    part: float, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    whole = drawing("<g/>" * 50)
    with pytest.raises(DocumentError, match="can't be read"):
        loading.parse(whole[: int(part * len(whole))].encode())
    if part == 0.9:
        body = whole[: int(part * len(whole))]
        QuickRun(tmp_path, body, capture=capfd).assert_refused("can't be read", "line 2", "save it anew")


DAMAGED = {
    "an entity that is not defined": drawing("<text>&nbsp;</text>"),
    "an ampersand": drawing("<text>a & b</text>"),
    "an attribute twice": drawing('<g a="1" a="2"/>'),
    "a tag that does not end": drawing("<g>"),
    "two drawings": drawing() + HEAD + "</svg>",
    "another encoding": drawing("<text>\xff</text>").encode("latin-1"),
    "an unknown encoding": drawing().replace('"1.0"', '"1.0" encoding="none"'),
    "a control character in an attribute": drawing('<g id="a\x0b" b="<"/>'),
    "a picture": b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR",
    "zeros": bytes(1000),
    "compressed": gzip.compress(drawing().encode()),
    "nothing but space": "  \n",
}


@pytest.mark.parametrize("data", DAMAGED.values(), ids=DAMAGED.keys())
def test_damaged_files_are_refused(data: str | bytes) -> None:
    with pytest.raises(
        DocumentError, match=r"^The drawing can't be read: .+ \(line \d+, column \d+\)\. Open"
    ):
        loading.parse(data if isinstance(data, bytes) else data.encode())


HARMLESS = {
    "a prefix of an attribute": ('<g id="x" foo:bar="1"/>', 'foo:bar="1"'),
    "a prefix of an element": ("<foo:bar/>", "<foo:bar/>"),
    "an element of no namespace": ('<bar xmlns=""/>', '<bar xmlns=""/>'),
    "a control character in a text": ("<text>a\x0bb</text>", ">ab</text>"),
}


@pytest.mark.parametrize(("body", "written"), HARMLESS.values(), ids=HARMLESS.keys())
def test_harmless_damage_is_accepted(
    body: str, written: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    run = QuickRun(tmp_path, drawing(body), capture=capfd)
    run.figures()
    assert written in run.output.read_text()


@pytest.mark.parametrize(
    "root", ['<html xmlns="http://www.w3.org/1999/xhtml"/>', "<html/>", "<a:b/>", "<g/>"]
)
def test_files_that_are_no_drawing_are_refused(root: str) -> None:
    with pytest.raises(DocumentError, match="not an SVG drawing: its outermost element is"):
        loading.parse(root.encode())


# --- too much of everything ---------------------------------------------------------------------


def nested(depth: int, tag: str = "g") -> str:
    return f"{HEAD}{f'<{tag}>' * depth}{PATH}{f'</{tag}>' * depth}{HANDLES}</svg>"


def test_groups_may_lie_in_hundreds_of_groups(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    run = QuickRun(tmp_path, nested(loading.DEEPEST - 2), capture=capfd)
    run.figures()
    text = run.output.read_text()
    assert text.count("<g>") == text.count("</g>") == loading.DEEPEST - 2
    assert f'<path id="p" d="{BLOB}"' not in text


@pytest.mark.parametrize(("depth", "tag"), [(1000, "g"), (3000, "g"), (100_000, "g"), (3000, "svg")])
def test_deep_nesting_is_refused(depth: int, tag: str, tmp_path: Path) -> None:
    Run(tmp_path, nested(depth, tag)).assert_refused("nested more than 1000 deep", "Ungroup")


@pytest.mark.parametrize("count", [1000, 50_000])
def test_many_attributes(count: int, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    attributes = " ".join(f'a{n}="{n}"' for n in range(count))
    began = time.monotonic()
    run = QuickRun(tmp_path, drawing().replace('<path id="p"', f'<path id="p" {attributes}'), capture=capfd)
    if count > loading.MOST_ATTRIBUTES:
        run.assert_refused("p has more than 2000 attributes", "Delete")
    else:
        run.figures()
        assert f'a{count - 1}="{count - 1}"' in run.output.read_text()
    assert time.monotonic() - began < 20.0


# Texts on which a regular expression backtracks, or searches the rest of the text from every place.
LONG = 100_000
ENDLESS = {
    "digits of a transform": f'<g transform="matrix({"1" * LONG}x"/>',
    "numbers of a transform": f'<g transform="matrix({"1.5 " * LONG}x"/>',
    "spaces of a transform": f'<g transform="translate(1{" " * LONG}x"/>',
    "digits of a length": f'<rect width="{"1" * LONG}x" height="5"/>',
    "spaces of a reference": f'<path style="fill:url({" " * LONG}#x" d="{BLOB}"/>',
    "spaces in a reference": f'<path style="fill:url(#x{" " * LONG}x" d="{BLOB}"/>',
    "references in a reference": f'<path style="fill:{"url(#" * LONG}" d="{BLOB}"/>',
    "comments of a style": f'<path style="{"/*" * LONG}" d="{BLOB}"/>',
    "comments of a sheet": f"<style>{'/*' * LONG}</style>",
    "blocks of a sheet": f"<style>{'@media{' * LONG}</style>",
    "half rules of a sheet": f"<style>{'a{' * LONG}</style>",
    "no rule at all": f"<style>{'a ' * LONG}</style>",
    "statements of a sheet": f"<style>{';' * LONG}</style><style>a{{{';' * LONG}}}</style>",
    "parts of a selector": f"<style>{'a>' * LONG}a{{fill:red}}</style>",
    "selectors in selectors": f"<style>{':not(' * LONG}a{')' * LONG}{{fill:red}}</style>",
    "declarations": f'<path style="{"a:b;" * LONG}" d="{BLOB}"/>',
    "zeros of an opacity": f'<path style="opacity:{"0" * LONG}x" d="{BLOB}"/>',
    "digits of a path": f'<path d="M0,0 L{"9" * LONG},5"/>',
    "spaces of a path": f'<path d="M0,0 {" " * LONG}x"/>',
    "numbers of a point list": f'<polygon points="{"1" * LONG}x"/>',
}


@pytest.mark.parametrize("name", ENDLESS)
def test_no_text_takes_endless_time(name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    began = time.process_time()
    run = QuickRun(tmp_path, drawing(ENDLESS[name]), capture=capfd)
    assert time.process_time() - began < 10.0
    if run.code:
        run.assert_refused("can't be read|not a length|not a number")
    else:
        run.figures()


def test_rules_are_read_as_before() -> None:
    sheet = (
        "@import url(x.css); rect { fill: red; stroke: blue } /* a { b: c } */ @media print { a { b: c } d { e: f } }"
        "<!-- .q, g { a: b } --> @font-face { x: y } z { a: b } y { } w { a: /* } */ c } v { unfinished /* x"
    )
    found = [(one, {name: value for name, (value, _) in of.items()}) for one, of in css.rules(sheet)]
    assert found == [
        ("rect", {"fill": "red", "stroke": "blue"}), (".q, g", {"a": "b"}), ("z", {"a": "b"}), ("y", {}),
        ("w", {"a": "c"}), ("v", {}),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("value", "identity"),
    [
        ("url(#a)", "a"), ("url( #a )", "a"), ("url('#a')", "a"), ('url( "#a b" ) red', "a b"), ("red", None),
        ("url('#a)", None), ("url(#a", None), ("url(b#a)", None), ("URL", None), ("url(#)", None),
    ],
)  # fmt: skip
def test_references_are_read_as_before(value: str, identity: str | None) -> None:
    assert references.referred(value) == identity
    if identity is not None:
        assert references.referred(references.redirected(value, "new")) == "new"


# --- names --------------------------------------------------------------------------------------

NAMES = {
    "quotes and markup": "a\"b<c>&d'e",
    "markup": "</span><b>bold</b>",
    "fields": "{0.__class__}",
    "named fields": "{name}{names}{ids}",
    "percent signs": "%s%(name)s%n",
    "a command": "$(touch hacked)`touch hacked`;touch hacked|touch hacked",
    "an expression": "') or ('1'='1",
    "letters": "ü日本😀",
    "an option": "--output=hacked",
    "a path": "../../hacked",
}


@pytest.mark.parametrize("name", NAMES.values(), ids=NAMES.keys())
def test_names_are_shown_to_the_letter(
    name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    words = re.escape(name)
    bad = f'<path id={quoteattr(name)} d="M0,0 L nan,5"/>'
    QuickRun(tmp_path, drawing(bad), capture=capfd).assert_refused(words, "can't be read")
    handle = circle("pin", 90, 60).replace('id="pin90"', f"id={quoteattr(name)}")
    QuickRun(tmp_path, drawing(handle), capture=capfd).assert_refused(words, "not on a curve")
    QuickRun(tmp_path, drawing(), f"--id={name}", capture=capfd).assert_refused(words, "no object")
    # It is found by its id, and the report has it.
    text = drawing(f'<g id={quoteattr(name)}><text id="t">T</text></g>').replace('"p"', quoteattr(name + "p"))
    text = text.replace('<text id="t">', f"<text id={quoteattr(name + 't')}>")
    run = QuickRun(tmp_path, text, f"--id={name}p", f"--id={name}", "--hold=apart", capture=capfd)
    assert [entry["id"] for entry in run.figures()["skipped"]] == [name + "t"]
    assert run.element(name + "p").get("d") != BLOB
    assert not [file for file in tmp_path.rglob("*") if "hacked" in file.name]


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("a&#10;b", r"a\nb"), ("a&#13;b", r"a\rb"), ("a&#9;b", r"a\tb"), ("&#x202e;gnp", r"\u202egnp"),
        ("a&#x2028;b", r"a\u2028b"), ("a&#x1b;b", None), ("a&#x9b;b", r"a\x9bb"),
    ],
)  # fmt: skip
def test_names_make_no_second_line_and_turn_nothing_round(
    name: str, shown: str | None, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    run = QuickRun(tmp_path, drawing(f'<path id="{name}" d="M0,0 L nan,5"/>'), capture=capfd)
    run.assert_refused(re.escape(shown) if shown else "can't be read")


def test_an_endless_name_leaves_room_for_the_remedy(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    run = QuickRun(tmp_path, drawing(f'<path id="{"n" * 1_000_000}" d="M0,0 L nan,5"/>'), capture=capfd)
    run.assert_refused("^nnnn", "nnn … nnn", "delete the object")
    assert len(run.stderr) < LONGEST_MESSAGE + 10


def test_a_message_of_usual_length_is_whole() -> None:
    assert str(AlupError("m" * LONGEST_MESSAGE)) == "m" * LONGEST_MESSAGE


# --- what a run does not do ---------------------------------------------------------------------

# Records the actions of Python that reach out of the process.
WATCH = """
import json, os, sys
fd = os.open("seen", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
def watch(event, arguments):
    if event.startswith(("socket.", "subprocess.", "os.system", "os.exec", "os.spawn", "os.posix_spawn", "urllib.",
                         "os.startfile", "webbrowser.", "pty.", "shutil.", "tempfile.", "http.")):
        os.write(fd, json.dumps([event, [str(a) for a in arguments]]).encode() + b"\\n")
    elif event == "open" and isinstance(arguments[2], int) and arguments[2] & (os.O_WRONLY | os.O_RDWR):
        os.write(fd, json.dumps([event, [str(arguments[0])]]).encode() + b"\\n")
sys.addaudithook(watch)
"""

REACHING = (
    '<?xml version="1.0"?><?xml-stylesheet href="{address}/sheet.css"?>'
    '<!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" "{address}/svg11.dtd">'
    + HEAD
    + '<style>@import url("{address}/import.css"); path {{ fill: url({address}/paint#a) }}</style>'
    '<image id="i" x="20" y="60" width="20" height="20" xlink:href="{address}/image.png"/>'
    '<image id="j" x="20" y="60" width="20" height="20" xlink:href="file://{folder}/secret.png"/>'
    '<use id="u" xlink:href="{address}/other.svg#a"/><script xlink:href="{address}/s.js">fetch("{address}/t")</script>'
    '<linearGradient id="l" xlink:href="{address}/g.svg#l"/><text style="font-family:\'$(touch hacked)\'">`touch hacked`</text>'
    '<foreignObject width="9" height="9"><iframe xmlns="http://www.w3.org/1999/xhtml" src="{address}/f"/></foreignObject>'
    '<path id="q" style="fill:url(#l);filter:url({address}/f#f);clip-path:url({address}/c.svg#c)" d="'
    + BLOB
    + '"/>'
    '<text id="t">T</text>' + PATH + HANDLES + "</svg>"
)


def test_a_run_reaches_out_for_nothing(server: tuple[str, list[str]], tmp_path: Path) -> None:
    """No connection, no other program, no file but those that were asked for."""
    address, asked = server
    case = Case(tmp_path / "case", REACHING.format(address=address, folder=tmp_path))
    case.at_start(WATCH)
    seen = case.folder / "seen"
    seen.touch()
    case.reshaped()
    events = [json.loads(line) for line in seen.read_text().splitlines()]
    assert asked == []
    # A worker, if there is one, opens its end of a pipe by number, and the place for what it prints.
    opened = {re.sub(r"\d+", "N", Path(arguments[0]).name) for event, arguments in events if event == "open"}
    assert {".alup-N.part", "report.json"} <= opened <= {".alup-N.part", "report.json", "N", "null"}
    assert [event for event, _ in events if event != "open"] == []
    text = case.output.read_text()
    for place in ("image.png", "other.svg#a", "s.js", "svg11.dtd", "sheet.css"):
        assert f"{address}/{place}" in text  # they stay what they are


def test_the_watch_sees_actions_that_reach_out(tmp_path: Path) -> None:
    """The watch above, on a program that does."""
    (tmp_path / "sitecustomize.py").write_text(WATCH)
    program = "import os, socket; socket.socket().close(); os.system('true'); open('x', 'w').close()"
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    subprocess.run([sys.executable, "-c", program], cwd=tmp_path, env=environment, check=True)
    seen = (tmp_path / "seen").read_text()
    for event in ("socket.__new__", "os.system", '["open", ["x"]]'):
        assert event in seen


SHELLS = {"system", "popen", "spawnl", "spawnv", "eval", "exec", "getoutput", "getstatusoutput"}


@pytest.mark.parametrize(
    "file", [*ROOT.glob("alup_*.py"), *(ROOT / "alup").rglob("*.py")], ids=lambda f: f.name
)
def test_no_source_has_a_shell(file: Path) -> None:
    """Without a shell, no text of a document can reach one."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call):
            name = getattr(node.func, "attr", getattr(node.func, "id", ""))
            assert name not in SHELLS, node.lineno
            assert all(keyword.arg != "shell" for keyword in node.keywords), node.lineno
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            names = {alias.name for alias in node.names} | {getattr(node, "module", "") or ""}
            assert not names & {"pickle", "marshal", "shelve", "pty", "commands"}, node.lineno


# --- files --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mask", "before", "mode"), [(0o022, None, 0o644), (0o077, None, 0o600), (0, 0o600, 0o600)]
)
def test_a_part_of_a_drawing_is_no_more_readable_than_it(
    mask: int, before: int | None, mode: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "drawing.svg"
    if before is not None:
        file.touch(before)
        file.chmod(before)
    modes = []
    replace = os.replace

    def noted(part: str, name: str) -> None:
        modes.append(stat.S_IMODE(os.stat(part).st_mode))
        replace(part, name)

    monkeypatch.setattr(os, "replace", noted)
    mask = os.umask(mask)
    try:
        effect.write_whole(str(file), b"new")
    finally:
        os.umask(mask)
    assert modes == [mode]
    assert file.read_bytes() == b"new"


def test_a_link_in_the_way_is_not_followed(tmp_path: Path) -> None:
    victim = tmp_path / "victim"
    victim.write_text("mine")
    (tmp_path / f".alup-{os.getpid()}.part").symlink_to(victim)
    with pytest.raises(FileExistsError):
        effect.write_whole(str(tmp_path / "drawing.svg"), b"new")
    assert victim.read_text() == "mine"


def test_the_folder_of_the_check_is_private(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import alup_check_installation as check

    modes = []

    def tried(_: str, folder: str) -> tuple[None, list[str]]:
        modes.append(stat.S_IMODE(os.stat(folder).st_mode))
        return None, []

    monkeypatch.setattr(check, "_tried", tried)
    check._trial(str(tmp_path))
    assert modes == [0o700]


@pytest.mark.parametrize("path", [".", "", "bin"])
def test_a_program_beside_the_drawing_is_not_started(
    path: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """When no inkex is known Inkscape is asked for it, but not one that came with the drawing."""
    (tmp_path / path).mkdir(exist_ok=True)
    program = tmp_path / path / "inkscape"
    program.write_text(f"#!/bin/sh\n: >{tmp_path}/hacked\necho {tmp_path}\n")
    program.chmod(0o755)
    (tmp_path / "extensions" / "inkex").mkdir(parents=True)
    (tmp_path / "extensions" / "inkex" / "__init__.py").touch()
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("INKSCAPE_COMMAND", raising=False)
    monkeypatch.setenv("PATH", path)
    assert startup.ask_inkscape_for_inkex() == ""
    assert not (tmp_path / "hacked").exists()
    # The same program, in a folder that the person has chosen.
    monkeypatch.setenv("PATH", str(program.parent))
    assert startup.ask_inkscape_for_inkex() == str(tmp_path / "extensions")


@pytest.mark.parametrize("name", ["numpy", "inkex", "alup", "json", "__future__"])
@pytest.mark.parametrize("effect_name", ["alup_reshape", "alup_check_installation"])
def test_modules_beside_the_drawing_are_not_imported(name: str, effect_name: str, tmp_path: Path) -> None:
    """With the real effects; test_startup.py has the ways to mislead the choice of the environment."""
    case = Case(tmp_path / "case")
    (case.folder / f"{name}.py").write_text("import os\nos._exit(77)\n")
    case.variables["PYTHONPATH"] = f".{os.pathsep}"
    if effect_name == "alup_reshape":
        case.reshaped()
    else:
        case.variables["PATH"] = "/usr/bin:/bin"
        done = case.run("--packages", script=ROOT / f"{effect_name}.py", to_stdout=True)
        assert (done.code, done.stderr) == (0, "")


def test_the_tree_is_inkexs_own() -> None:
    """Elements have the classes that Inkscape's extensions know."""
    import inkex

    root = loading.parse(drawing().encode()).getroot()
    assert isinstance(root, inkex.SvgDocumentElement)
    assert isinstance(root.getElementById("p"), inkex.PathElement)
