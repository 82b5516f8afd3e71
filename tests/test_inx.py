# SPDX-License-Identifier: GPL-2.0-or-later
"""Every .inx is valid by Inkscape's schemas, agrees with its script, and is explained to the user."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
import unittest
from pathlib import Path
from typing import Any, Iterator

import pytest
from inkex.tester.inx import INX_SCHEMAS, InxMixin
from lxml import etree

ROOT = Path(__file__).resolve().parents[1]
FILES = sorted(ROOT.glob("*.inx"))
NS = "{http://www.inkscape.org/namespace/inkscape/extension}"

every = pytest.mark.parametrize("file", FILES, ids=[file.stem for file in FILES])


class _Check(InxMixin, unittest.TestCase):
    """inkex's own checks."""


@pytest.fixture
def in_the_folder(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    # inkex looks for the script beside the .inx and imports it.
    monkeypatch.chdir(ROOT)
    monkeypatch.syspath_prepend(str(ROOT))
    yield


def params(file: Path) -> list[Any]:
    return [p for p in etree.parse(str(file)).iter(f"{NS}param") if p.get("type") not in ("notebook",)]


def text(file: Path, tag: str) -> str:
    return str(etree.parse(str(file)).getroot().findtext(f"{NS}{tag}"))


def test_there_are_effects_and_schemas() -> None:
    assert ROOT / "alup_reshape.inx" in FILES
    assert {name.rsplit(".", 1)[1] for name in INX_SCHEMAS} == {"rng", "schema"}


@every
def test_valid_by_the_schemas(file: Path) -> None:
    document = etree.parse(str(file))
    for name, schema in INX_SCHEMAS.items():
        assert schema.validate(document), (name, schema.error_log)


def test_the_schemas_find_mistakes() -> None:
    """Schemas that accept everything would prove nothing."""
    document = etree.parse(str(FILES[0]))
    document.getroot().append(etree.Element(f"{NS}surprise"))
    assert not INX_SCHEMAS["inkscape.extension.rng"].validate(document)
    document = etree.parse(str(FILES[0]))
    (identity,) = document.getroot().findall(f"{NS}id")
    document.getroot().remove(identity)
    assert not all(schema.validate(document) for schema in INX_SCHEMAS.values())


@every
@pytest.mark.usefixtures("in_the_folder")
def test_parameters_agree_with_the_options(file: Path) -> None:
    _Check().assertInxIsGood(file.name)


@every
@pytest.mark.usefixtures("in_the_folder")
def test_defaults_ranges_and_choices_agree_with_the_script(file: Path) -> None:
    """What inkex does not compare: defaults of 0, and choices that only the script has."""
    module = importlib.import_module(file.stem)
    name = "".join(part.title() for part in file.stem.split("_"))
    parser = getattr(module, name)().arg_parser
    actions = {action.dest: action for action in parser._actions}
    for param in params(file):
        action = actions[param.get("name")]
        if param.get("type") == "optiongroup":
            offered = [option.get("value") for option in param.iter(f"{NS}option")]
            assert offered[0] == action.default
            if action.choices is None:  # more than one can be chosen on the command line
                assert set(offered) <= {"all", "none"}
            else:
                assert set(offered) == set(action.choices)
        elif param.get("type") in ("int", "float"):
            assert float(param.text) == pytest.approx(float(action.default))
            assert float(param.get("min")) <= float(param.text) <= float(param.get("max"))
        elif param.get("type") == "bool":
            assert param.text == str(action.default).lower()


@every
def test_identity_menu_and_script(file: Path) -> None:
    root = etree.parse(str(file)).getroot()
    assert text(file, "id") == f"org.alup.{file.stem}"
    assert text(file, "name")
    assert [menu.get("name") for menu in root.iter(f"{NS}submenu")] == ["ALUP Reshape"]
    (command,) = root.iter(f"{NS}command")
    assert command.text == f"{file.stem}.py"
    assert command.get("interpreter") == "python"
    assert command.get("location") == "inx"
    assert (ROOT / command.text).is_file()
    assert os.access(ROOT / command.text, os.R_OK)
    assert len(str(root.findtext(f".//{NS}menu-tip"))) > 20


def test_ids_are_unique() -> None:
    assert len({text(file, "id") for file in FILES}) == len(FILES)
    assert len({text(file, "name") for file in FILES}) == len(FILES)


@every
def test_every_parameter_is_explained(file: Path) -> None:
    for param in params(file):
        label, help_text = param.get("gui-text") or "", param.get("gui-description") or ""
        assert label, param.get("name")
        assert len(help_text.split()) >= 4, param.get("name")
        assert help_text[-1] in ".)", param.get("name")


def test_all_effects_are_there() -> None:
    """Each with its script, and no script without its menu item."""
    names = {file.stem for file in FILES}
    assert names >= {"alup_reshape", "alup_place_handles", "alup_remove_handles", "alup_check_installation"}
    assert names == {file.stem for file in ROOT.glob("alup_*.py")}


@every
def test_names_have_no_dots_of_their_own(file: Path) -> None:
    """Inkscape adds dots to the name of an effect that has a dialog."""
    assert not text(file, "name").endswith((".", "\u2026"))


def test_the_menu_is_in_the_order_of_work() -> None:
    """Inkscape sorts it by name in the user's language, in which numbers come first everywhere."""
    names = sorted(text(file, "name") for file in FILES)
    assert [name.partition(". ")[2] for name in names] == [
        "Reshape live", "Place handles", "Reshape", "Restore original", "Remove handles",
        "Check installation", "Set up",
    ]  # fmt: skip
    assert [name.partition(". ")[0] for name in names] == [str(n + 1) for n in range(len(names))]


@every
def test_the_menu_takes_every_selection(file: Path) -> None:
    """Including none: the effect itself says what is missing."""
    (effect,) = etree.parse(str(file)).getroot().findall(f"{NS}effect")
    assert effect.findtext(f"{NS}object-type") == "all"
    assert effect.get("needs-live-preview") in ("true", "false")


def test_the_check_has_no_dialog() -> None:
    assert params(ROOT / "alup_check_installation.inx") == []


@pytest.mark.usefixtures("in_the_folder")
def test_inkex_finds_nothing_wrong() -> None:
    """The same from the command line, in a process that imports the effects anew."""
    command = [sys.executable, "-m", "inkex.tester.test_inx_file", "-q", *(file.name for file in FILES)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_reshape_has_live_preview_and_takes_every_selection() -> None:
    (effect,) = etree.parse(str(ROOT / "alup_reshape.inx")).getroot().findall(f"{NS}effect")
    assert effect.get("needs-live-preview", "true") == "true"
    assert effect.findtext(f"{NS}object-type") == "all"


def test_reshape_has_the_parameters_that_it_must() -> None:
    names = {param.get("name") for param in params(ROOT / "alup_reshape.inx")}
    wanted = {"scope", "spacing", "hold", "keep_handles", "tolerance", "iterations", "report"}
    weights = {f"weight_{term}" for term in ("normal", "tangent", "straight", "handle", "component")}
    assert names >= wanted | weights


def test_the_dialog_has_the_choices_of_a_designer_and_no_others() -> None:
    """Other options are for the command line and the preferences; the dialog fits beside a drawing."""
    shown = {p.get("name") for p in params(ROOT / "alup_reshape.inx") if p.get("gui-hidden") != "true"}
    assert shown == {"scope", "method", "hold", "regular", "crossings", "add_nodes", "keep_handles"}
    assert not list(etree.parse(str(ROOT / "alup_reshape.inx")).iter(f"{NS}page"))
