#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-or-later
# Make docs/gallery, the comparison with other methods and the studies, from the drawings in the tree:
# sh docs/gallery.sh [--out FOLDER] [--jobs N] [--only CASE ...]
set -eu

cd "$(dirname "$0")/.."
sh tests/run.sh --set-up
# The pool has a process for each core already.
OMP_NUM_THREADS=1 exec .venv/bin/python benchmarks/gallery.py "$@"
