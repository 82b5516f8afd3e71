#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-or-later
# Mutation testing: which wrong signs, operators, comparisons and numbers would no test notice?
#
#     sh tests/mutation.sh energy           # or network, refit; or any module, with its tests:
#     sh tests/mutation.sh fit tests/test_refit.py
#
# A copy of the checkout is mutated, never the checkout. Takes seconds a mutant: ten minutes for energy, an hour
# for network. Ends with the mutants that survived, as differences; the others were killed. MUTATION.md says why
# the ones that survive do.
set -eu

cd "$(dirname "$0")/.."
module=${1:?"name a module of alup/: energy, network, refit"}
shift
# What each mutant is tried on, the quickest first.
case "$module" in
energy) usual='tests/test_energy.py tests/test_ablations.py' ;;
network) usual='tests/test_network.py tests/test_sample.py tests/test_contacts.py tests/test_pipeline.py' ;;
refit) usual='tests/test_refit.py tests/test_pipeline.py' ;;
*) usual="tests/test_$module.py" ;;
esac
[ $# -eq 0 ] || usual="$*"
cosmic_ray='cosmic-ray==8.7.0'

sh tests/run.sh --set-up
if ! .venv/bin/python -c 'import cosmic_ray' 2>/dev/null; then
    # shellcheck disable=SC2086 # a list of words
    .venv/bin/python -m pip install --quiet --disable-pip-version-check $cosmic_ray
fi
tools=$PWD/.venv/bin
copy=$(mktemp -d)
trap 'rm -rf "$copy"' EXIT
trap 'exit 1' HUP INT TERM
cp -r alup tests benchmarks examples pyproject.toml alup_*.py alup_*.inx "$copy"
cd "$copy"

# One replacement of each kind: the opposite sign or operator, the comparison's edge and its reverse. The other
# ten of each arithmetic operator die of the same tests.
cat >mutation.toml <<END
[cosmic-ray]
module-path = "alup/$module.py"
timeout = 120.0
test-command = "$tools/python -B -m pytest -x -q -p no:cacheprovider $usual"

[cosmic-ray.distributor]
name = "local"

[cosmic-ray.filters.operators-filter]
exclude-operators = [
    "core/ReplaceBinaryOperator_(?!(Add_Sub|Sub_Add|Mul_Div|Div_Mul|Pow_Mul|BitOr_BitAnd|BitAnd_BitOr)$)",
    "core/ReplaceComparisonOperator_(?!(LtE?_(LtE?|GtE?)|GtE?_(LtE?|GtE?)|Eq_NotEq|NotEq_Eq|Is_IsNot|IsNot_Is)$)",
    "core/ReplaceUnaryOperator_(?!Delete_)",
]
END
# Old bytecode could stand for a mutant of the same size and second.
find . -name __pycache__ -prune -exec rm -rf {} +
"$tools/cosmic-ray" init mutation.toml mutants.sqlite
"$tools/cr-filter-operators" mutants.sqlite mutation.toml
"$tools/cosmic-ray" baseline mutation.toml
"$tools/cosmic-ray" exec mutation.toml mutants.sqlite
"$tools/cr-report" --show-diff --surviving-only mutants.sqlite
