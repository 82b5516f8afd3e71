# SPDX-License-Identifier: GPL-2.0-or-later
"""Messages: all are collected, all translations are complete, and a run speaks the user's language."""

from __future__ import annotations

import ast
import importlib.util
import os
import re
import string
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Iterator

import polib
import pytest
from lxml import etree

from alup.messages import language

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "locale"
SOURCES = [*sorted(ROOT.glob("alup_*.py")), *sorted((ROOT / "alup").rglob("*.py"))]
TRANSLATIONS = sorted(FOLDER.glob("*.po"))
MESSAGE = "The handle {name} has no size. Delete it and draw a circle instead."

# Imported by its path, because the folder has the name of a module of the standard library.
_SPEC = importlib.util.spec_from_file_location("update_translations", FOLDER / "update.py")
assert _SPEC is not None and _SPEC.loader is not None
update: Any = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(update)

every_source = pytest.mark.parametrize("file", SOURCES, ids=lambda file: str(file.relative_to(ROOT)))
every_language = pytest.mark.parametrize("po", TRANSLATIONS, ids=lambda po: po.stem)


def fields(message: str) -> set[tuple[str, str, str]]:
    """Name, format and conversion of the fields of a template."""
    parts = string.Formatter().parse(message)
    return {(name, form or "", conversion or "") for _, name, form, conversion in parts if name is not None}


def environment(**variables: str) -> dict[str, str]:
    """The environment of the tests, with no other language than the given one."""
    inherited = {k: v for k, v in os.environ.items() if not k.startswith(("LANG", "LC_", "PYTHON"))}
    return {**inherited, **variables}


@pytest.fixture
def fresh(monkeypatch: pytest.MonkeyPatch) -> Iterator[pytest.MonkeyPatch]:
    """The language is looked up anew, before and after the test."""
    for name in ("LANGUAGE", "LC_ALL", "LC_MESSAGES", "LANG"):
        monkeypatch.delenv(name, raising=False)
    language._catalogue.cache_clear()
    yield monkeypatch
    language._catalogue.cache_clear()


# --- the files ----------------------------------------------------------------------------------


def test_both_ways_of_marking_are_collected() -> None:
    source = 'TEXT = N_(\n    "one "\n    "text"\n)\nf(_("two {name}").format(name=1), _(TEXT), g("three"))\n'
    assert list(update.of_python(source)) == ["one text", "two {name}"]


def test_texts_that_inkscape_shows_are_collected() -> None:
    source = """<inkscape-extension xmlns="http://www.inkscape.org/namespace/inkscape/extension">
    <name>Name</name><id>no</id>
    <param name="no" type="x" gui-text="Text" gui-description="Long text">no</param>
    <param name="no" type="x" gui-text="no" translatable="no"><option value="no">Option</option></param>
    <label>  one\n   line </label><label xml:space="preserve">two\n  lines</label>
    <effect needs-live-preview="false"><effects-menu><submenu name="Menu"/></effects-menu>
    <menu-tip>Tip</menu-tip></effect>
    </inkscape-extension>"""
    wanted = ["Name", "Text", "Long text", "Option", "one line", "two\n  lines", "Menu", "Tip"]
    assert list(update.of_inx(source)) == wanted
    with_preview = list(update.of_inx(source.replace('"false"', '"true"')))
    assert set(with_preview) - set(wanted) == {"Live preview", "Is the effect previewed live on canvas?"}


def test_the_files_are_up_to_date() -> None:
    """If this fails: .venv/bin/python locale/update.py, and translate what is new."""
    outputs = update.outputs()
    assert len(outputs) == 1 + 2 * len(TRANSLATIONS)
    for path, content in outputs.items():
        assert path.read_bytes() == content, path.relative_to(ROOT)
    compiled = set(FOLDER.rglob("*.mo"))
    assert compiled == {path for path in outputs if path.suffix == ".mo"}


def test_there_is_a_translation_and_enough_to_translate() -> None:
    assert FOLDER / "de.po" in TRANSLATIONS
    messages = {entry.msgid for entry in update.template()}
    assert len(messages) > 100
    assert {MESSAGE, "3. Reshape", "the whole drawing"} <= messages


def test_messages_call_a_frame_one_thing() -> None:
    """The word is the dialog's.  Only the label in a file is another one."""
    said = [entry.msgid for entry in polib.pofile(str(FOLDER / "alup-reshape.pot"))]
    assert not [message for message in said if re.search(r"(?<!alup:)\bsections?\b", message, re.IGNORECASE)]
    assert any("frame" in message for message in said)


@every_language
def test_every_message_is_translated(po: Path) -> None:
    file = polib.pofile(str(po))
    assert [entry.msgid for entry in file.untranslated_entries()] == []
    assert [entry.msgid for entry in file.fuzzy_entries()] == []
    assert [entry.msgid for entry in file.obsolete_entries()] == []


@every_language
def test_translations_have_the_fields_of_the_message(po: Path) -> None:
    """A field that the code does not fill would raise an error instead of the message."""
    for entry in polib.pofile(str(po)):
        if "python-brace-format" in entry.flags:
            assert fields(entry.msgstr) == fields(entry.msgid), entry.msgid
        else:
            assert "{" not in entry.msgid + entry.msgstr, entry.msgid


@every_language
def test_translations_keep_the_words_of_the_contract(po: Path) -> None:
    """Labels of handles, and how texts begin and end."""
    for entry in polib.pofile(str(po)):
        labels = re.findall(r"alup:\w+", entry.msgid)
        assert sorted(re.findall(r"alup:\w+", entry.msgstr)) == sorted(labels), entry.msgid
        for mark in (".", ":", "\n"):
            assert entry.msgstr.endswith(mark) == entry.msgid.endswith(mark), entry.msgid
        assert entry.msgstr.count("\n") == entry.msgid.count("\n"), entry.msgid
        # Code recognises an error about an attribute by the name in front, and does not repeat the name.
        assert entry.msgstr.startswith("{name}: ") == entry.msgid.startswith("{name}: "), entry.msgid


@every_language
def test_the_compiled_file_says_the_same(po: Path) -> None:
    compiled = polib.mofile(str(FOLDER / po.stem / "LC_MESSAGES" / "alup-reshape.mo"))
    texts = {entry.msgid: entry.msgstr for entry in polib.pofile(str(po))}
    assert {entry.msgid: entry.msgstr for entry in compiled} == texts
    assert compiled.metadata["Content-Type"] == "text/plain; charset=UTF-8"


def test_an_update_keeps_translations() -> None:
    pot, old = polib.POFile(), polib.POFile()
    pot.extend([polib.POEntry(msgid="new"), polib.POEntry(msgid="kept", occurrences=[("a.py", "")])])
    old.extend([polib.POEntry(msgid="gone", msgstr="weg"), polib.POEntry(msgid="kept", msgstr="geblieben")])
    new = update.updated(old, pot, "de")
    assert [(entry.msgid, entry.msgstr) for entry in new if not entry.obsolete] == [
        ("new", ""),
        ("kept", "geblieben"),
    ]
    assert [(entry.msgid, entry.msgstr) for entry in new.obsolete_entries()] == [("gone", "weg")]
    assert new.metadata["Language"] == "de"


@pytest.mark.parametrize("file", sorted(ROOT.glob("*.inx")), ids=lambda file: file.stem)
def test_dialogs_name_the_catalogue(file: Path) -> None:
    assert etree.parse(str(file)).getroot().get("translationdomain") == language.DOMAIN == update.DOMAIN


# --- the sources --------------------------------------------------------------------------------


def is_translation(node: ast.AST) -> bool:
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "_"


def untranslated(node: ast.AST) -> Iterator[str]:
    """Texts with words in them, outside of _("...")."""
    if is_translation(node):
        return
    if isinstance(node, ast.Constant) and isinstance(node.value, str) and re.search("[a-z] ", node.value):
        yield node.value
    for child in ast.iter_child_nodes(node):
        yield from untranslated(child)


def raised(source: str) -> list[str]:
    """Texts of errors for the user that are not translated."""
    kinds = {"AlupError", "DocumentError", "HandleError", "SolveError", "DependencyError", "AbortExtension"}
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call):
            name = getattr(node.func, "id", getattr(node.func, "attr", ""))
            if name in kinds:
                found += [text for argument in node.args for text in untranslated(argument)]
    return found


def test_untranslated_errors_are_seen() -> None:
    source = 'raise HandleError(f"The handle {n} is bad.")\nraise inkex.AbortExtension(_("It is so."))'
    assert raised(source) == ["The handle ", " is bad."]


@every_source
def test_every_error_is_translated(file: Path) -> None:
    assert raised(file.read_text(encoding="utf-8")) == []


@every_source
def test_messages_kept_for_later_are_translated_where_they_are_used(file: Path) -> None:
    tree = ast.parse(file.read_text(encoding="utf-8"))
    kept = {
        node.targets[0].id
        for node in tree.body
        if isinstance(node, ast.Assign)
        and isinstance(node.targets[0], ast.Name)
        and isinstance(node.value, ast.Call)
        and getattr(node.value.func, "id", "") == "N_"
    }
    used = [n for n in ast.walk(tree) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)]
    inside = {id(part) for call in ast.walk(tree) if is_translation(call) for part in ast.walk(call)}
    assert [node.id for node in used if node.id in kept and id(node) not in inside] == []
    assert kept <= {node.id for node in used}


@every_source
def test_no_function_assigns_to_the_translating_name(file: Path) -> None:
    """In a function that assigns to `_`, a call `_("...")` would fail."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    for function in functions:
        comprehensions = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)
        own_scope = {
            id(part)
            for node in ast.walk(function)
            if isinstance(node, comprehensions)
            for part in ast.walk(node)
        }
        parts = [node for node in ast.walk(function) if id(node) not in own_scope]
        binds = any(isinstance(n, ast.Name) and n.id == "_" and isinstance(n.ctx, ast.Store) for n in parts)
        assert not (binds and any(is_translation(node) for node in ast.walk(function))), function.name


# --- looking up ---------------------------------------------------------------------------------


def test_the_language_is_that_of_the_environment(fresh: pytest.MonkeyPatch) -> None:
    german = polib.pofile(str(FOLDER / "de.po")).find(MESSAGE).msgstr
    for variable, value, wanted in (
        ("LANGUAGE", "de", german),
        ("LANGUAGE", "xx:de_AT", german),
        ("LANG", "de_DE.UTF-8", german),
        ("LC_ALL", "de_CH", german),
        ("LANG", "C", MESSAGE),
        ("LANGUAGE", "en_GB", MESSAGE),
    ):
        with fresh.context() as patch:
            patch.setenv(variable, value)
            language._catalogue.cache_clear()
            assert language.translate(MESSAGE) == wanted, (variable, value)


@pytest.mark.parametrize(
    "value", ["", ":", "::de_", "../..", "/", "de/../de\udcff", "\u00e4.\u00f6@\u00fc", "@" * 5000]
)
def test_a_broken_environment_is_no_error(fresh: pytest.MonkeyPatch, value: str) -> None:
    fresh.setenv("LANGUAGE", value)
    fresh.setenv("LC_ALL", value)
    assert language.translate(MESSAGE) in (MESSAGE, polib.pofile(str(FOLDER / "de.po")).find(MESSAGE).msgstr)


def damaged(good: bytes) -> Iterator[tuple[str, bytes]]:
    yield "empty", b""
    yield "text", b"This is no catalogue."
    yield "short", good[:10]
    yield "half", good[: len(good) // 2]
    yield "version", good[:4] + b"\xff\xff\xff\xff" + good[8:]
    yield "charset", good.replace(b"charset=UTF-8", b"charset=UTF-9")
    yield "bytes", good.replace("ö".encode(), b"\xff\xff")
    yield "header", good.replace(b"MIME-Version: 1.0", b"Plural-Forms: 1;;")


GOOD = (FOLDER / "de" / "LC_MESSAGES" / "alup-reshape.mo").read_bytes()


@pytest.mark.parametrize("name, content", list(damaged(GOOD)), ids=[name for name, _ in damaged(GOOD)])
def test_a_damaged_catalogue_is_english(
    fresh: pytest.MonkeyPatch, tmp_path: Path, name: str, content: bytes
) -> None:
    assert content != GOOD
    file = tmp_path / "de" / "LC_MESSAGES" / "alup-reshape.mo"
    file.parent.mkdir(parents=True)
    file.write_bytes(content)
    fresh.setenv("LANGUAGE", "de")
    fresh.setattr(language, "FOLDER", str(tmp_path))
    assert language.translate(MESSAGE) == MESSAGE


def test_without_catalogues_all_is_english(fresh: pytest.MonkeyPatch, tmp_path: Path) -> None:
    fresh.setenv("LANGUAGE", "de")
    fresh.setattr(language, "FOLDER", str(tmp_path / "nowhere"))
    assert language.translate(MESSAGE) == MESSAGE == language.N_(MESSAGE)


def test_nothing_is_looked_up_before_it_is_needed() -> None:
    program = "import sys, alup.messages.language; print('gettext' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("False\n", "")


def test_looking_up_is_quick(fresh: pytest.MonkeyPatch) -> None:
    """A catalogue takes some milliseconds once; a hundred would be noticed."""
    fresh.setenv("LANGUAGE", "de")
    begun = time.perf_counter()
    language.translate(MESSAGE)
    assert time.perf_counter() - begun < 0.1


# --- runs ---------------------------------------------------------------------------------------

BAD = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 200 200"
  xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape">
  <path id="p" d="M 10,10 H 90 V 60 Q"/><circle inkscape:label="alup:pin" cx="10" cy="10" r="1"/></svg>"""
NO_HANDLES = BAD.replace(" Q", "").replace("alup:", "")


def run(folder: Path, script: str, body: str, *arguments: str, **variables: str) -> tuple[int, str]:
    """Exit code and message of an effect; it must write no drawing."""
    file, output = folder / "in.svg", folder / "out.svg"
    file.write_text(body, encoding="utf-8")
    command = [sys.executable, str(ROOT / f"{script}.py"), f"--output={output}", *arguments, str(file)]
    done = subprocess.run(command, env=environment(**variables), cwd=folder, capture_output=True, timeout=120)
    assert done.stdout == b"" and not output.exists()
    return done.returncode, done.stderr.decode("utf-8").strip()


@pytest.mark.parametrize(
    "script, body, english, german",
    [
        (
            "alup_reshape",
            BAD,
            "p: its path data can't be read at character 20 (\u201c\u201d): Q takes 4 numbers. "
            "Correct it in the XML editor or delete the object.",
            "p: Seine Pfaddaten sind ab Zeichen 20 (\u201e\u201c) nicht lesbar: zu Q geh\u00f6ren 4 Zahlen. "
            "Berichtige das im XML-Editor oder l\u00f6sche das Objekt.",
        ),
        ("alup_reshape", NO_HANDLES, "There are no handles. Put", "Es gibt keine Griffe. Setze"),
        ("alup_remove_handles", NO_HANDLES, "There are no handles in", "In der Zeichnung sind keine Griffe"),
        ("alup_restore_original", NO_HANDLES, "None of the objects", "Keines der Objekte dieser Zeichnung"),
    ],
)
def test_a_run_complains_in_the_users_language(
    tmp_path: Path, script: str, body: str, english: str, german: str
) -> None:
    code, said = run(tmp_path, script, body, LANG="C.UTF-8")
    assert said.startswith(english) and code != 0
    assert run(tmp_path, script, body, LANGUAGE="de", LANG="C.UTF-8")[0] == code
    for variables in ({"LANGUAGE": "de"}, {"LANG": "de_DE.UTF-8"}):
        assert run(tmp_path, script, body, **variables)[1].startswith(german)


def test_why_objects_are_skipped_is_translated(tmp_path: Path) -> None:
    body = NO_HANDLES.replace("<path", '<text id="t">x</text><path')
    said = run(tmp_path, "alup_reshape", body, "--id=t", LANGUAGE="de")[1]
    assert said.startswith("Es ist kein Pfad ausgew\u00e4hlt, nur t (Text).")


def test_a_start_without_packages_is_explained() -> None:
    program = "from alup import startup; startup._leave(['scipy'], 'Python 3.7')"
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, env=environment(LANGUAGE="de"), capture_output=True
    )
    assert done.returncode == 1
    said = done.stderr.decode("utf-8")
    assert said.startswith("ALUP Reshape kann nicht starten: Python 3.")
    assert "findet scipy nicht; seine Pakete wurden f\u00fcr Python 3.7 installiert." in said
    assert said.endswith("Erweiterungen > ALUP Reshape > Einrichten...\n")


def test_the_check_speaks_the_language_too() -> None:
    done = subprocess.run(
        [sys.executable, str(ROOT / "alup_check_installation.py")],
        env=environment(LANGUAGE="de"),
        capture_output=True,
        timeout=120,
    )
    said = done.stderr.decode("utf-8")
    assert done.returncode == 0, said
    assert re.match(r"ALUP Reshape [\d.]+ kann laufen\.\n", said)
    assert "\nErweiterung: " in said
    assert re.search(r"\nVersuch: Eine Zeichnung wurde in \d+\.\d s umgeformt", said)
