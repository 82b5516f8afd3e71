# SPDX-License-Identifier: GPL-2.0-or-later
"""The summary of a sweep: counts by outcome and by reason, and the times of the runs."""

from __future__ import annotations

import collections
from typing import Any, Iterator

import numpy as np
from sweep_verdict import OUTCOMES, SUSPICIOUS_GROWTH


def figures(found: list[dict[str, Any]]) -> dict[str, Any]:
    """The summary as data."""
    outcomes = collections.Counter(one["outcome"] for one in found)
    reasons: dict[str, dict[str, int]] = {}
    for one in found:
        if one["outcome"] != "reshaped":
            by = reasons.setdefault(one["outcome"], {})
            by[one["reason"]] = by.get(one["reason"], 0) + 1
    valid = [one for one in found if one["outcome"] not in ("no geometry", "unreadable")]
    refused_files = {one["file"] for one in valid if one["outcome"] == "refused"}
    return {
        "runs": len(found),
        "files": len({one["file"] for one in found}),
        "files_with_geometry": len({one["file"] for one in valid}),
        "files_refused": len(refused_files),
        "versions": sorted({one["version"] for one in found if "version" in one}),
        "outcomes": {name: outcomes[name] for name in OUTCOMES if outcomes[name]},
        "reasons": reasons,
        "seconds": {name: _percentiles(found, name) for name in ("seconds", "cpu")},
        "megabytes": max((one.get("megabytes", 0) for one in found), default=0),
        "kinds": dict(collections.Counter(one["kind"] for one in found)),
        "scopes": dict(collections.Counter(one.get("scope", "none") for one in found)),
        "notes": dict(collections.Counter(note for one in found for note in one.get("notes", []))),
        "suspicious": sum(one.get("growth", 0.0) > SUSPICIOUS_GROWTH for one in found),
        "lasting": sum("lasting" in one for one in found),
        "handles_missed": max((one.get("missed", 0.0) for one in found), default=0.0),
    }


def _percentiles(found: list[dict[str, Any]], name: str) -> dict[str, float]:
    values = [one[name] for one in found if one.get(name) is not None]
    if not values:
        return {}
    shares = {"50 %": 50, "90 %": 90, "99 %": 99, "max": 100}
    return {label: round(float(np.percentile(values, share)), 3) for label, share in shares.items()}


def summary(found: list[dict[str, Any]]) -> Iterator[str]:
    """Lines for people."""
    if not found:
        yield "Nothing was run."
        return
    told = figures(found)
    runs, valid = told["runs"], max(told["files_with_geometry"], 1)
    yield f"{runs} runs of {told['files']} files; code {', '.join(told['versions'])}"
    yield f"kinds: {_listed(told['kinds'])}; selected: {_listed(told['scopes'])}"
    yield ""
    for name, count in told["outcomes"].items():
        yield f"{name:<16} {count:>7}  {100.0 * count / runs:6.2f} %"
    yield ""
    share = 100.0 * told["files_refused"] / valid
    yield f"refused, of files with geometry: {told['files_refused']} of {valid} ({share:.2f} %)"
    for outcome, reasons in told["reasons"].items():
        yield ""
        yield f"{outcome}:"
        for reason, count in sorted(reasons.items(), key=lambda item: -item[1]):
            yield f"  {count:>6}  {reason}"
            example = next(one for one in found if one["outcome"] == outcome and one["reason"] == reason)
            yield f"          e.g. {example['file']}, {example['kind']}"
    yield ""
    for name, values in told["seconds"].items():
        label = {"seconds": "seconds of the clock", "cpu": "seconds of the processor"}[name]
        yield f"{label}: " + ", ".join(f"{share} {value:g}" for share, value in values.items())
    yield f"memory: at most {told['megabytes']} MB; notes: {_listed(told['notes']) or 'none'}"
    yield (
        f"handles missed by at most {told['handles_missed']:.1e} of the diagonal; "
        f"{told['suspicious']} outputs reach far beyond input and handles"
    )
    if told["lasting"]:
        yield f"run once more and restored: {told['lasting']} outputs"


def _listed(counts: dict[str, int]) -> str:
    return ", ".join(f"{name} {count}" for name, count in counts.items())
