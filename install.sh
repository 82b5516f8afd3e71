#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-or-later
# Install ALUP Reshape for the Inkscape of this user.
#
# Inkscape's own Python has no scipy and must not be written to, so the extension gets a private
# environment beside it (alup/startup.py says how a run finds it). All is made in a folder beside
# the installed one and takes its place only when it has been checked: a failed install leaves the
# working one as it was.
set -eu

# What runs need. lxml: inkex does not allow version 6. tinycss2: inkex 1.4 imports it.
packages='numpy scipy lxml<6 cssselect tinycss2'
# Of lxml 5 there is no wheel for Python 3.14 and later; nothing that inkex is used for here fails with 6.
packages_since_3_14='numpy scipy lxml<7 cssselect tinycss2'
# Faster with the first, more methods with libigl, but there is not a wheel for every machine.
optional_packages='qdldl libigl'
name=alup-reshape
flatpak_name=org.inkscape.Inkscape
action=org.alup.alup-reshape.noprefs
# The demonstration takes seconds; an effect that opens a window would wait for ever.
demo_seconds=180

usage() {
    cat <<'END'
Usage: sh install.sh [--demo | --check | --uninstall] [--dry-run]

Without an option: install the extension into Inkscape's extensions folder of this user.

  --demo       install, then reshape examples/truck.svg through Inkscape's command line;
               leaves alup-demo.svg and alup-demo.png in the current folder.
               Installs Inkscape, Xvfb and python3-venv by apt-get when missing and permitted.
  --check      only tell whether the installed extension can run
  --uninstall  remove the extension with its environment
  --dry-run    only tell what would be done
  --help       this text

INKSCAPE_COMMAND names the inkscape to use when it is not on the PATH, or is not the one wanted;
INKSCAPE_PROFILE_DIR is respected as Inkscape does. Nothing is written outside the extensions folder.
Where Inkscape is a Flatpak, a Snap, an AppImage or an application of macOS or Windows, that is said,
and what follows from it; docs/platforms.md has more.
END
}

say() { printf '%s\n' "$*"; }

fail() {
    printf 'install.sh: %s\n' "$*" >&2
    exit 1
}

# --- finding things -----------------------------------------------------------------------------

find_inkscape() {
    inkscape=$(command -v "${INKSCAPE_COMMAND:-inkscape}" || true)
    if [ -z "$inkscape" ] && [ -z "${INKSCAPE_COMMAND:-}" ]; then
        find_off_path || true
    fi
    [ -n "$inkscape" ]
}

# Where macOS, Windows, Flatpak and Snap have it, none of which need be on the PATH.
find_off_path() {
    for place in /Applications "$HOME/Applications"; do
        inkscape=$(command -v "$place/Inkscape.app/Contents/MacOS/inkscape") && return
    done
    inkscape=$(command -v "/c/Program Files/Inkscape/bin/inkscape.exe") && return
    for place in "${XDG_DATA_HOME:-$HOME/.local/share}" /var/lib; do
        inkscape=$(command -v "$place/flatpak/exports/bin/$flatpak_name") && return
    done
    inkscape=$(command -v /snap/bin/inkscape)
}

# AppImages lie anywhere; these are the folders where people keep them.
name_appimages() {
    for file in "$HOME"/Applications/*nkscape*.[Aa]pp[Ii]mage "$HOME"/bin/*nkscape*.[Aa]pp[Ii]mage \
        "$HOME"/.local/bin/*nkscape*.[Aa]pp[Ii]mage "$HOME"/Downloads/*nkscape*.[Aa]pp[Ii]mage; do
        if [ -f "$file" ]; then say "There is an AppImage; for it: INKSCAPE_COMMAND='$file' sh install.sh" >&2; fi
    done
}

# Within the sandbox of Inkscape's Flatpak or Snap all is as usual.
in_sandbox() { [ "${FLATPAK_ID:-}" = "$flatpak_name" ] || [ "${SNAP_NAME:-}" = inkscape ]; }

# How Inkscape came to this machine decides which Python runs the extension, and from where.
recognise() {
    kind=
    if in_sandbox; then return; fi
    case $(uname -s) in
    MINGW* | MSYS* | CYGWIN*)
        kind=windows
        return
        ;;
    esac
    case $inkscape in
    */exports/bin/"$flatpak_name") kind=flatpak ;;
    */snap/bin/inkscape) kind=snap ;;
    *.[Aa]pp[Ii]mage) kind=appimage ;;
    *.app/Contents/MacOS/*) kind=bundle ;;
    esac
}

# A script named inkscape that starts a Flatpak or a Snap is known by the profile it answers.
recognise_profile() {
    if in_sandbox; then return; fi
    case $profile in
    */.var/app/"$flatpak_name"/*) kind=flatpak ;;
    */snap/inkscape/*) kind=snap ;;
    esac
}

# Where Inkscape's Python can't be started from here, go on where it can, or say what to do.
hand_over() {
    case $kind in
    flatpak)
        go_on_in_flatpak
        exit
        ;;
    snap) explain_snap ;;
    windows) explain_windows ;;
    esac
}

# A Flatpak's Python and inkex are there in its sandbox only: the installer goes on in it.
go_on_in_flatpak() {
    say "Inkscape is a Flatpak ($inkscape). The Python in its sandbox will run the extension, so the installer"
    say "goes on there; the extension's place is $HOME/.var/app/$flatpak_name/config/inkscape/extensions/$name"
    if [ "$mode" = demo ]; then
        fail "the demonstration needs a display of its own, which the sandbox has not; run sh install.sh, then" \
            "Extensions > ALUP Reshape > Reshape on examples/truck.svg"
    fi
    command -v flatpak >/dev/null || fail "the command flatpak was not found; nothing was changed"
    set -- "$here/install.sh" "--$mode"
    [ "$mode" != install ] || set -- "$here/install.sh"
    # Downloading needs the network, which the sandbox has not by itself.
    flatpak run --share=network "--filesystem=$here:ro" --command=sh "$flatpak_name" "$@" ${dry_run:+--dry-run}
}

# Its confinement can't be entered with a command; its shell can.
explain_snap() {
    say "Inkscape is a Snap ($inkscape). The Python in it will run the extension; the extension's place is below"
    say "$HOME/snap/inkscape/current/.config/inkscape or $HOME/.config/inkscape, as the Snap decides."
    fail "open a shell in the Snap by 'snap run --shell inkscape', and in it run: sh '$here/install.sh'" \
        "(the Snap reads your home folder only, without what begins with a dot)"
}

# Its Python can't load PyPI's packages, and a Windows Python keeps its environments differently.
explain_windows() {
    say "Inkscape is one of Windows ($inkscape). Its Python can't load the packages; one from python.org has to"
    python=$(command -v py || command -v python || true)
    say "run the extension (here: ${python:-none was found}), from ${APPDATA:-%APPDATA%}/inkscape/extensions/$name"
    fail "this script can't do it on Windows; the commands to type are in docs/platforms.md, under Windows"
}

introduce() {
    case $kind in
    appimage)
        say "Inkscape is an AppImage ($inkscape). Its Python is there only while it runs; $python, for which the"
        say "environment is made, will run the extension."
        ;;
    bundle)
        say "Inkscape is a macOS application ($inkscape). Its Python starts the extension; $python, for which the"
        say "environment is made, will run it."
        ;;
    esac
}

# Even when only asked for a folder, Inkscape makes its profile: let it do so in a throw-away home.
ask_inkscape() {
    mkdir -p "$tmp/home" "$tmp/config"
    (
        unset INKSCAPE_PROFILE_DIR
        HOME=$tmp/home XDG_CONFIG_HOME=$tmp/config "$inkscape" "$1" || "$inkscape" "$1"
    ) 2>/dev/null </dev/null | tail -n 1
}

find_folders() {
    if [ -n "${INKSCAPE_PROFILE_DIR:-}" ]; then
        profile=$INKSCAPE_PROFILE_DIR
    else
        answer=$(ask_inkscape --user-data-directory)
        case $answer in
        "$tmp/config"/*) profile=${XDG_CONFIG_HOME:-$HOME/.config}${answer#"$tmp/config"} ;;
        "$tmp/home"/*) profile=$HOME${answer#"$tmp/home"} ;;
        /*) profile=$answer ;;
        *) fail "$inkscape does not tell its user data directory; Inkscape 1.0 or later is needed" ;;
        esac
    fi
    case $profile in
    /*) ;;
    *) profile=$(pwd)/$profile ;;
    esac
    set_target
    inkex=$(ask_inkscape --system-data-directory)/extensions
    # An AppImage has it only while it runs; the effect is then told by Inkscape where it is.
    [ -f "$inkex/inkex/__init__.py" ] || inkex=
}

set_target() {
    extensions=$profile/extensions
    target=$extensions/$name
    stage=$extensions/.$name-new
    old=$extensions/.$name-old
}

# As Inkscape looks for it: its preferences, then its own folder (put first on the PATH), then PATH.
find_python() {
    python=
    if [ -f "$profile/preferences.xml" ]; then
        python=$(sed -n 's/.*python-interpreter="\([^"]*\)".*/\1/p' "$profile/preferences.xml" | head -n 1)
        python=$(command -v "$python" || true)
    fi
    if [ -z "$python" ]; then
        beside=$(dirname "$(readlink -f "$inkscape" 2>/dev/null || printf '%s' "$inkscape")")
        python=$(PATH=$beside:$PATH command -v python3 || PATH=$beside:$PATH command -v python || true)
    fi
    [ -n "$python" ] && recent_enough "$python"
}

recent_enough() { "$1" -c 'import sys; sys.exit(sys.version_info < (3, 8))' 2>/dev/null; }

# --- the environment ----------------------------------------------------------------------------

# make_environment PYTHON FOLDER: FOLDER/venv with all packages, made for PYTHON
make_environment() {
    venv=$2/venv
    rm -rf "$venv"
    if ! "$1" -m venv "$venv" >>"$log" 2>&1; then
        # Debian keeps pip's copy for environments in python3-venv; a pip outside serves as well.
        rm -rf "$venv"
        "$1" -m venv --without-pip "$venv" >>"$log" 2>&1 || return 1
    fi
    # shellcheck disable=SC2046 # a list of words
    fetch "$1" "$venv" $(packages_of "$1") || return 1
    fetch_optional "$1" "$venv"
}

packages_of() {
    if "$1" -c 'import sys; sys.exit(sys.version_info < (3, 14))'; then
        say "$packages_since_3_14"
    else
        say "$packages"
    fi
}

# fetch PYTHON ENVIRONMENT PACKAGE...: by the environment's pip, else by that of the Python it was made for
fetch() {
    maker=$1
    environment=$2
    shift 2
    if "$environment/bin/python3" -c 'import pip' 2>/dev/null; then
        set -- "$environment/bin/python3" -m pip install "$@"
    else
        site=$("$environment/bin/python3" -c 'import sysconfig; print(sysconfig.get_paths()["purelib"])') || return 1
        set -- "$maker" -m pip install --target "$site" --upgrade "$@"
    fi
    # The cache would be a write outside the folder. Wheels only: nothing is compiled here.
    "$@" --quiet --no-cache-dir --disable-pip-version-check --only-binary :all: >>"$log" 2>&1
}

# fetch_optional PYTHON ENVIRONMENT: those that are not there yet; left_out are those that are not to be had
fetch_optional() {
    left_out=
    for package in $optional_packages; do
        if "$2/bin/python3" -c 'import importlib.metadata, sys; importlib.metadata.version(sys.argv[1])' \
            "$package" 2>/dev/null; then continue; fi
        fetch "$1" "$2" "$package" || left_out="$left_out $package"
    done
}

tell_left_out() {
    for package in $left_out; do
        say "Note: $package is not to be had for this Python; something slower or simpler stands in."
    done
}

# Inkscape's Python first: packages made for it are used without starting a second one.
make_environment_somehow() {
    other=$(command -v python3 || true)
    make_environment "$python" "$1" && return
    if [ -n "$other" ] && [ "$other" != "$python" ] && recent_enough "$other"; then
        make_environment "$other" "$1" && return
    fi
    return 1
}

why_no_environment() {
    tail -n 5 "$log" >&2
    if "$python" -c 'import ensurepip' 2>/dev/null || "$python" -m pip --version >/dev/null 2>&1; then
        fail "the packages ($(packages_of "$python")) could not be installed; nothing was changed"
    fi
    fail "Python's venv or pip is missing (on Debian: sudo apt-get install python3-venv); nothing was changed"
}

# Whether the installed environment was made for the Python that Inkscape starts.
environment_fits() {
    "$python" - "$stage" "$target" <<'END'
import sys

sys.path.insert(0, sys.argv[1])
from alup import startup

record = startup.read_record(sys.argv[2])
sys.exit(record is None or record["tag"] != startup.interpreter_tag())
END
}

write_record() {
    "$1/venv/bin/python3" -c '
import sys
sys.path.insert(0, sys.argv[1])
from alup import startup
startup.write_record(sys.argv[1], sys.argv[2])' "$1" "$inkex"
}

# --- checking -----------------------------------------------------------------------------------

# can_run FOLDER: import what a run imports, then start each effect as Inkscape does. What is wrong
# goes to $log. A word on stderr counts as wrong: Inkscape would open a window for it.
can_run() {
    [ -f "$1/environment.json" ] || {
        say "$1 has no environment" >>"$log"
        return 1
    }
    "$1/venv/bin/python3" -E -s - "$1" "$inkex" >>"$log" 2>&1 <<'END' || return 1
import importlib
import os
import pkgutil
import sys

root, inkex = sys.argv[1:]
sys.path.insert(0, root)
names = ["numpy", "scipy.sparse.linalg", "lxml.etree", "cssselect", "tinycss2"]
if inkex:
    from alup import startup

    os.environ[startup.HANDED_OVER] = inkex
    startup.prepare(os.path.join(root, "alup_reshape.py"))
    import alup

    names += ["inkex"] + [module.name for module in pkgutil.walk_packages(alup.__path__, "alup.")]
for name in names:
    if not name.endswith("__main__"):
        importlib.import_module(name)
END
    [ -n "$inkex" ] || return 0
    for effect in "$1"/alup_*.py; do
        (
            cd "$1" || exit 1
            PYTHONPATH=$extensions:$inkex "$python" "${effect##*/}" --help
        ) >/dev/null 2>"$tmp/stderr" </dev/null || {
            cat "$tmp/stderr" >>"$log"
            return 1
        }
        if [ -s "$tmp/stderr" ]; then
            cat "$tmp/stderr" >>"$log"
            return 1
        fi
    done
}

check() {
    [ -d "$target" ] || fail "not installed ($target is not there); run sh install.sh"
    if ! can_run "$target"; then
        tail -n 5 "$log" >&2
        fail "the extension in $target cannot run; install it once more: sh install.sh"
    fi
    describe
    say "The extension can run."
}

describe() {
    "$target/venv/bin/python3" -E -s - "$target" "${inkex:-known to Inkscape only}" "$python" \
        "$(ask_inkscape --version | cut -d ' ' -f 1,2)" "$packages $optional_packages" <<'END'
import sys

root, inkex, python, inkscape, packages = sys.argv[1:]
sys.path.insert(0, root)
import re
from importlib.metadata import PackageNotFoundError, version

import alup


def known(name):
    try:
        return name + " " + version(name)
    except PackageNotFoundError:
        return name + " (left out)"


print("ALUP Reshape", alup.__version__, "for", inkscape)
print("  extension  ", root)
print("  environment", "Python {}.{}.{}:".format(*sys.version_info[:3]),
      ", ".join(known(re.split("[<>=]", package)[0]) for package in packages.split()))
print("  Inkscape's ", python + ", inkex:", inkex)
END
}

# --- installing ---------------------------------------------------------------------------------

install() {
    [ ! -L "$target" ] || fail "$target is a link, perhaps to a checkout; remove it first: rm '$target'"
    for file in alup_reshape.inx alup_reshape.py alup/startup.py; do
        [ -f "$here/$file" ] || fail "$here/$file is missing: run install.sh from a complete checkout"
    done
    mkdir -p "$extensions"
    installing=yes
    restore_old
    rm -rf "$stage" "$old"
    mkdir "$stage"
    cp "$here"/alup_*.inx "$here"/alup_*.py "$here/install.sh" "$stage"
    cp -R "$here/alup" "$stage/alup"
    copy_catalogues
    find "$stage" -name __pycache__ -prune -exec rm -rf {} +
    if borrow_environment; then
        say "Using the environment that is there."
    else
        say "Making an environment for $python; this downloads about 70 MB ..."
        make_environment_somehow "$stage" || why_no_environment
        write_record "$stage"
        if ! can_run "$stage"; then
            tail -n 20 "$log" >&2
            fail "the extension does not run on this machine; nothing was changed"
        fi
    fi
    tell_left_out
    "$stage/venv/bin/python3" -m compileall -q "$stage/alup" "$stage"/alup_*.py || true # only speed
    if [ -d "$target" ]; then mv "$target" "$old"; fi
    mv "$stage" "$target"
    borrowed=
    installing=
    rm -rf "$old"
    describe
    say "Start Inkscape anew, then: Extensions > ALUP Reshape"
}

# Translations as programs read them; where there are none, all is in English.
copy_catalogues() {
    for catalogue in "$here"/locale/*/LC_MESSAGES/*.mo; do
        [ -f "$catalogue" ] || continue
        folder=$stage/${catalogue#"$here/"}
        folder=${folder%/*}
        mkdir -p "$folder"
        cp "$catalogue" "$folder"
    done
}

# A good environment for this Python moves into the new folder; clean_up brings it back if need be.
borrow_environment() {
    [ -d "$target/venv" ] && [ -f "$target/environment.json" ] || return 1
    environment_fits 2>>"$log" || return 1
    borrowed=yes
    mv "$target/venv" "$stage/venv"
    # A newer version of the extension may know more of them than the one that made the environment.
    fetch_optional "$python" "$stage/venv"
    if write_record "$stage" 2>>"$log" && can_run "$stage"; then return; fi
    bring_back
    return 1
}

bring_back() {
    if [ -n "$borrowed" ] && [ -d "$stage/venv" ]; then mv "$stage/venv" "$target/venv"; fi
    borrowed=
}

# An install that was cut off between its two last moves left the working copy under another name.
restore_old() {
    if [ -d "$old" ] && [ ! -e "$target" ]; then mv "$old" "$target"; fi
}

uninstall() {
    if [ ! -e "$target" ] && [ ! -L "$target" ]; then
        say "Nothing to remove: $target is not there."
        return
    fi
    rm -rf "$target" "$stage" "$old"
    # Empty, they were made by install.sh or will be made again by Inkscape.
    rmdir "$extensions" "$profile" 2>/dev/null || true
    say "Removed $target"
}

# --- the demonstration --------------------------------------------------------------------------

install_missing_programs() {
    missing=
    # Inkscape's other effects need these three, which it only recommends.
    find_inkscape || missing="$missing inkscape python3-lxml python3-numpy python3-cssselect"
    command -v xvfb-run >/dev/null || missing="$missing xvfb"
    command -v xauth >/dev/null || missing="$missing xauth"
    if [ -x /usr/bin/dpkg ] && ! /usr/bin/python3 -c 'import ensurepip' 2>/dev/null; then
        missing="$missing python3-venv"
    fi
    [ -n "$missing" ] || return 0
    if [ -n "$dry_run" ]; then
        say "Would install by apt-get:$missing"
        return
    fi
    command -v apt-get >/dev/null || fail "these are missing, and this system has no apt-get:$missing"
    if [ "$(id -u)" -eq 0 ]; then
        as_root='env'
    elif sudo -n true 2>/dev/null; then
        as_root='sudo -n env'
    else
        fail "these programs are missing; install them, then try again: sudo apt-get install$missing"
    fi
    say "Installing by apt-get:$missing ..."
    # shellcheck disable=SC2086 # lists of words
    {
        $as_root DEBIAN_FRONTEND=noninteractive apt-get -qq update >>"$log" 2>&1 &&
            $as_root DEBIAN_FRONTEND=noninteractive apt-get -qq install --yes --no-install-recommends \
                $missing </dev/null >>"$log" 2>&1
    } || {
        tail -n 5 "$log" >&2
        fail "apt-get could not install$missing"
    }
}

# Inkscape in a throw-away home and profile that borrows only the extensions folder, so that its
# preferences stay as they are. What the effect says goes to a file in place of a window.
inkscape_apart() {
    HOME=$tmp/home INKSCAPE_PROFILE_DIR=$tmp/profile TMPDIR=$tmp XDG_CONFIG_HOME=$tmp/config \
        XDG_CACHE_HOME=$tmp/home XDG_DATA_HOME=$tmp/home DBUS_SESSION_BUS_ADDRESS=disabled: \
        timeout -k 10 "$demo_seconds" "$@" >>"$log" 2>&1 </dev/null
}

demo() {
    mkdir -p "$tmp/profile" "$tmp/home"
    ln -s "$extensions" "$tmp/profile/extensions"
    cat >"$tmp/python" <<END
#!/bin/sh
'$python' "\$@" 2>>'$tmp/said'
code=\$?
echo \$code >'$tmp/code'
exit \$code
END
    chmod +x "$tmp/python"
    cat >"$tmp/profile/preferences.xml" <<END
<inkscape version="1"><group id="options"><group id="boot" enabled="0"/></group>
<group id="extensions" python-interpreter="$tmp/python"/></inkscape>
END
    : >"$tmp/said"
    say "Reshaping $example in Inkscape ..."
    inkscape_apart xvfb-run -a "$inkscape" --app-id-tag="alup$$" --batch-process \
        --actions="$action;export-filename:$tmp/after.svg;export-do" "$example" ||
        demo_failed "Inkscape failed"
    [ -f "$tmp/code" ] || demo_failed "Inkscape did not run the effect"
    if [ "$(cat "$tmp/code")" != 0 ] || [ -s "$tmp/said" ]; then demo_failed "the effect complained"; fi
    [ -f "$tmp/after.svg" ] || demo_failed "Inkscape wrote nothing"
    "$python" - "$example" "$tmp/after.svg" <<'END' || demo_failed "no path was changed"
import sys
import xml.etree.ElementTree as tree


def paths(file):
    return {e.get("id"): e.get("d") for e in tree.parse(file).iter("{http://www.w3.org/2000/svg}path")}


before, after = map(paths, sys.argv[1:])
changed = [name for name in before if after.get(name, before[name]) != before[name]]
print(f"{len(changed)} of {len(before)} paths were reshaped.")
sys.exit(not changed)
END
    for drawing in before after; do
        if [ $drawing = before ]; then file=$example; else file=$tmp/after.svg; fi
        inkscape_apart "$inkscape" --export-area-page --export-width=640 --export-background=white \
            --export-filename="$tmp/$drawing.png" "$file" || demo_failed "no picture could be drawn"
    done
    "$python" - "$tmp" <<'END'
import base64
import os
import struct
import sys

folder = sys.argv[1]
parts, x, height = [], 0, 0
for drawing in ("before", "after"):
    with open(os.path.join(folder, drawing + ".png"), "rb") as file:
        png = file.read()
    size = struct.unpack(">II", png[16:24])
    data = base64.b64encode(png).decode()
    parts.append(
        f'<text x="{x + 20}" y="32" font-family="sans-serif" font-size="22">{drawing}</text>'
        f'<image x="{x + 20}" y="48" width="{size[0]}" height="{size[1]}" xlink:href="data:image/png;base64,{data}"/>'
    )
    x, height = x + size[0] + 40, max(height, size[1])
with open(os.path.join(folder, "both.svg"), "w") as file:
    file.write(
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'
        f' width="{x}" height="{height + 68}">'
        f'<rect width="{x}" height="{height + 68}" fill="white"/>{"".join(parts)}</svg>'
    )
END
    inkscape_apart "$inkscape" --export-area-page --export-filename="$tmp/both.png" "$tmp/both.svg" ||
        demo_failed "no picture could be drawn"
    [ -s "$tmp/both.png" ] || demo_failed "no picture could be drawn"
    cp "$tmp/after.svg" alup-demo.svg
    cp "$tmp/both.png" alup-demo.png
    say "Look at alup-demo.png (before and after) and alup-demo.svg in $(pwd)"
}

demo_failed() {
    tail -n 5 "$log" >&2
    if [ -s "$tmp/said" ]; then cat "$tmp/said" >&2; fi
    fail "the demonstration failed: $1"
}

# --- the command --------------------------------------------------------------------------------

clean_up() {
    if [ -n "$installing" ]; then
        restore_old
        bring_back
        rm -rf "$stage" "$old"
    fi
    rm -rf "$tmp"
}

mode=install
dry_run=
for argument in "$@"; do
    case $argument in
    --demo | --check | --uninstall) mode=${argument#--} ;;
    --dry-run) dry_run=yes ;;
    --help | -h)
        usage
        exit
        ;;
    *)
        usage >&2
        fail "unknown option $argument"
        ;;
    esac
done

here=$(cd "$(dirname "$0")" && pwd)
# Nothing of the caller's Python may leak into the environment, nor pip put things elsewhere.
unset PYTHONPATH PYTHONHOME PIP_TARGET PIP_PREFIX PIP_USER PIP_REQUIRE_VIRTUALENV
borrowed=
installing=
tmp=$(mktemp -d) || fail "no temporary folder; make room on the disk, or correct TMPDIR"
log=$tmp/log
kind=
: >"$log"
trap clean_up EXIT
trap 'exit 130' INT
trap 'exit 143' HUP TERM

if [ "$mode" = demo ]; then
    example=$here/examples/truck.svg
    [ -f "$example" ] || fail "$example is missing: run the demonstration from a complete checkout"
    if find_inkscape; then
        recognise
        hand_over
    fi
    install_missing_programs
fi
if find_inkscape; then
    recognise
    hand_over
    find_folders
    recognise_profile
    hand_over
elif [ "$mode" = uninstall ]; then
    # Inkscape may have been removed first; this is where it would have been.
    profile=${INKSCAPE_PROFILE_DIR:-${XDG_CONFIG_HOME:-$HOME/.config}/inkscape}
    set_target
elif [ "$mode" = demo ] && [ -n "$dry_run" ]; then
    say "Would then install the extension, and reshape examples/truck.svg"
    exit
else
    name_appimages
    fail "Inkscape was not found; install it (on Debian: sudo apt-get install inkscape) or set INKSCAPE_COMMAND"
fi
if [ "$mode" != uninstall ]; then
    find_python || fail "Inkscape's Python was not found, or is older than 3.8"
    introduce
fi

if [ -n "$dry_run" ]; then
    case "$mode" in
    uninstall) say "Would remove $target" ;;
    check) say "Would check $target with $python" ;;
    *)
        say "Would install into $target"
        say "  with an environment for $python: $(packages_of "$python") $optional_packages"
        if [ "$mode" = demo ]; then say "Would reshape examples/truck.svg and write alup-demo.svg and alup-demo.png here"; fi
        ;;
    esac
    exit
fi
case "$mode" in
install) install ;;
check) check ;;
uninstall) uninstall ;;
demo)
    install
    demo
    ;;
esac
