#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Reshape every SVG of some folders, and say how each run ended.

    python benchmarks/sweep.py --results sweep.jsonl FOLDER...
    python benchmarks/sweep.py --results sweep.jsonl --summary

Each file is given handles for one of three kinds of edit in turn, drawn from a seed (`sweep_handles`).  The
effect runs on it as in Inkscape (`sweep_process`), and the output is compared with the input
(`sweep_check`).  A run ends as one of

    reshaped      and the comparison found no fault
    refused       with one sentence of ours, although the drawing shows something
    no geometry   refused with one sentence of ours, because nothing in it could be reshaped
    unreadable    no SVG, refused with one sentence of ours

Every other outcome is a defect: no-op (success, but nothing moved), unverified, traceback, foreign message
(refused with a text that is no sentence of ours), stray output, hang, signal, harness (a fault of the sweep).

Results are lines of JSON, one for each run, appended as they come; a later call resumes from them.  Nothing
is downloaded.  These commands fetch the two folders of the project's figures:

    apt-get download openclipart-svg && dpkg-deb -x openclipart-svg_*.deb openclipart
    npm pack @tabler/icons && tar xzf tabler-icons-*.tgz

as openclipart/usr/share/openclipart/svg (7,458 drawings) and package/icons (6,287 icons).
"""

from __future__ import annotations

import argparse
import collections
import contextlib
import gc
import hashlib
import importlib
import json
import os
import re
import shutil
import signal
import sys
import tempfile
import time
import traceback
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable

import one_thread  # noqa: F401 - before numpy is imported

os.environ["LANGUAGE"] = "en"  # sentences are recognised in English

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "benchmarks")]

import sweep_handles
import sweep_lasting
import sweep_process
import sweep_summary
import sweep_verdict
from sweep_verdict import GOOD, Settings
from tqdm import tqdm

import alup_reshape

# Modules that a run imports late.  They are imported here, so that no fork has to.
for _name in ("scipy.spatial", "scipy.sparse.csgraph", "scipy.sparse.linalg", "qdldl"):
    with contextlib.suppress(ImportError):
        importlib.import_module(_name)


@dataclass(frozen=True)
class Job:
    """One run.  key : the file's name in results, with the folder's; kind : of `sweep_handles.KINDS`"""

    path: Path
    key: str
    kind: str
    seed: int

    @property
    def identity(self) -> tuple[str, str, int]:
        return self.key, self.kind, self.seed


def main() -> int:
    """Returns 0 if every requested run ended well or was refused with a sentence."""
    given = _arguments()
    results = Path(given.results)
    if not given.summary:
        if not given.folders:
            raise SystemExit("Which folders? Or --summary.")
        done = latest(read_results(results))
        jobs = [
            job
            for job in jobs_of(
                [Path(folder) for folder in given.folders], given.kinds, given.each, given.seed, given.sample
            )
            if _is_due(done.get(job.identity), given.again)
            and not (given.without and re.search(given.without, job.key))
        ]
        keep = Path(given.keep) if given.keep else None
        settings = Settings(given.limit, given.megabytes, keep, given.inkscape, given.lasting)
        sweep(jobs, results, settings, given.jobs)
    found = list(latest(read_results(results)).values())
    text = "\n".join(sweep_summary.summary(found))
    print(text)
    if given.json:
        Path(given.json).write_text(
            json.dumps(sweep_summary.figures(found), indent=1) + "\n", encoding="utf-8"
        )
    return 0 if all(one["outcome"] in (*GOOD, "refused") for one in found) else 1


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--results", required=True, help="file of JSON lines, which is continued")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="runs at a time")
    parser.add_argument("--kinds", nargs="+", choices=sweep_handles.KINDS, default=list(sweep_handles.KINDS))
    parser.add_argument("--each", type=int, default=len(sweep_handles.KINDS), help="kinds for each file")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--sample", type=int, default=0, metavar="N", help="N files, drawn by the seed")
    parser.add_argument("--without", metavar="PATTERN", help="leave out files whose names have this in them")
    parser.add_argument(
        "--again", action="append", default=[], metavar="OUTCOME", help="run those that ended so once more"
    )
    parser.add_argument("--summary", action="store_true", help="only print what the results say")
    parser.add_argument("--json", help="write the summary's figures to this file")
    parser.add_argument("--keep", help="folder for the files of runs that ended in a defect")
    parser.add_argument("--limit", type=float, default=Settings.limit, help="processor seconds for one run")
    parser.add_argument("--megabytes", type=int, default=Settings.megabytes, help="memory for one run")
    parser.add_argument(
        "--inkscape", type=float, default=0.0, metavar="SHARE", help="of the outputs that Inkscape draws too"
    )
    parser.add_argument(
        "--lasting",
        type=float,
        default=0.0,
        metavar="SHARE",
        help="of the outputs that are run again and restored",
    )
    parser.add_argument("folders", nargs="*", help="with SVG files, also in folders of theirs")
    return parser.parse_args()


# --- what to run --------------------------------------------------------------------------------


def jobs_of(folders: list[Path], kinds: list[str], each: int, seed: int, sample: int = 0) -> list[Job]:
    """All runs: every file with one kind of edit, then every file with its next kind, `each` times.

    Links to other files are left out.
    """
    files = [
        (f"{folder.resolve().name}/{path.relative_to(folder)}", path)
        for folder in folders
        for path in sorted(folder.rglob("*.svg"))
        if path.is_file() and not path.is_symlink()
    ]
    order = sweep_handles.random_of("order", seed).permutation(len(files))
    files = [files[n] for n in (order[:sample] if sample else order)]
    first = {key: int(sweep_handles.random_of("kind", key, seed).integers(len(kinds))) for key, _ in files}
    return [
        Job(path, key, kinds[(first[key] + turn) % len(kinds)], seed)
        for turn in range(min(each, len(kinds)))
        for key, path in files
    ]


def read_results(path: Path) -> list[dict[str, Any]]:
    """The lines of a file of results.  The last one may be incomplete after a sweep was ended."""
    lines = path.read_text(encoding="utf-8").split("\n") if path.exists() else []
    return [json.loads(line) for line in lines[:-1] if line]


def latest(results: list[dict[str, Any]]) -> dict[tuple[str, str, int], dict[str, Any]]:
    """The last result of every run."""
    return {(one["file"], one["kind"], one["seed"]): one for one in results}


def _is_due(before: dict[str, Any] | None, again: list[str]) -> bool:
    return before is None or before["outcome"] in again


# --- the runs -----------------------------------------------------------------------------------


def sweep(jobs: list[Job], results: Path, settings: Settings, at_a_time: int) -> None:
    """Run jobs, each in a process of its own, and append what was found to the results."""
    tqdm.monitor_interval = 0  # its thread would be forked
    # Signals are only noted: Python ignores an exception that is raised while it forks.
    asked: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: asked.append(number))
    gc.freeze()  # forks share what they don't change
    version = version_of_package()
    folder = Path(tempfile.mkdtemp(prefix="alup-sweep-"))
    waiting = list(reversed(jobs))
    active: dict[int, tuple[Job, Path, float]] = {}
    counts: collections.Counter[str] = collections.Counter()
    _end_line(results)
    with open(results, "a", encoding="utf-8") as out, tqdm(total=len(jobs), unit="run") as bar:
        try:
            while waiting or active:
                if asked:
                    raise KeyboardInterrupt
                while waiting and len(active) < at_a_time:
                    job = waiting.pop()
                    own = Path(tempfile.mkdtemp(dir=folder))
                    active[_start(job, own, settings)] = (job, own, time.monotonic())
                pid = _ended(
                    active, 2.0 * sweep_process.PATIENCE * settings.limit + 4 * sweep_verdict.DRAWING_LIMIT
                )
                if not pid:
                    time.sleep(0.005)
                    continue
                job, own, _ = active.pop(pid)
                record = {**_record_of(job, own), "version": version}
                out.write(json.dumps(record) + "\n")
                out.flush()
                counts[record["outcome"]] += 1
                shutil.rmtree(own)
                bar.update()
                bar.set_postfix({k: n for k, n in counts.items() if k not in GOOD}, refresh=False)
        finally:
            _end(set(active))
            shutil.rmtree(folder, ignore_errors=True)


def _stop(*_: object) -> None:
    raise KeyboardInterrupt


def _end(running: set[int]) -> None:
    """End jobs, which end their runs.  The signal is repeated in case the first one was lost."""
    while running:
        for pid in list(running):
            try:
                if os.waitpid(pid, os.WNOHANG)[0]:
                    running.discard(pid)
                else:
                    os.kill(pid, signal.SIGTERM)
            except ChildProcessError:  # it had ended
                running.discard(pid)
        time.sleep(0.5 if running else 0.0)


def version_of_package() -> str:
    """A digest of the code that runs, which tells its versions apart."""
    digest = hashlib.sha256()
    for path in sorted([ROOT / "alup_reshape.py", *(ROOT / "alup").rglob("*.py")]):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def _end_line(results: Path) -> None:
    """Cut off an incomplete last line."""
    if results.exists():
        data = results.read_bytes()
        results.write_bytes(data[: data.rfind(b"\n") + 1])


def _start(job: Job, own: Path, settings: Settings) -> int:
    """Begin a job in a fork.  Returns its process id."""
    sys.stdout.flush()
    sys.stderr.flush()
    pid = os.fork()
    if pid:
        return pid
    try:
        signal.signal(signal.SIGTERM, _stop)  # also ends its run
        record = examine(job, own, settings)
        (own / "record.json").write_text(json.dumps(record), encoding="utf-8")
    except BaseException:  # noqa: BLE001 - the parent reports it as a defect of the sweep
        (own / "harness").write_text(traceback.format_exc(), encoding="utf-8")
    finally:
        os._exit(0)


def _ended(active: dict[int, tuple[Job, Path, float]], limit: float) -> int:
    """A job that has ended, 0 for none; one that is over the limit is killed."""
    for pid, (_, _, since) in active.items():
        if os.waitpid(pid, os.WNOHANG)[0]:
            return pid
        if time.monotonic() - since > limit:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
            return pid
    return 0


def _record_of(job: Job, own: Path) -> dict[str, Any]:
    about = {"file": job.key, "kind": job.kind, "seed": job.seed}
    if (own / "record.json").exists():
        return {**about, **json.loads((own / "record.json").read_text(encoding="utf-8"))}
    why = (
        (own / "harness").read_text(encoding="utf-8")
        if (own / "harness").exists()
        else "ended without a word"
    )
    return {**about, "outcome": "harness", "reason": why.strip().split("\n")[-1], "detail": why}


def examine(
    job: Job,
    own: Path,
    settings: Settings,
    effect: Callable[[list[str]], None] | None = None,
) -> dict[str, Any]:
    """Prepare, run and check one file.  own : an empty folder; effect : in place of Reshape's `run`"""
    rng = sweep_handles.random_of(job.key, job.kind, job.seed)
    before, report = own / "in.svg", own / "report.json"
    svg = sweep_handles.load(job.path) if job.path.read_bytes().strip() else None
    case = None
    if svg is None:
        before.write_bytes(job.path.read_bytes())
    else:
        case = sweep_handles.prepare(svg, job.kind, rng)
        svg.getroottree().write(str(before), encoding="utf-8", xml_declaration=True)
    arguments = [*(f"--id={name}" for name in (case.ids if case else [])), f"--report={report}", str(before)]
    run = effect or (lambda words: alup_reshape.AlupReshape().run(words))
    sys.argv = [str(ROOT / "alup_reshape.py"), *arguments]
    ended = sweep_process.run(lambda: run(arguments), own, settings.limit, settings.megabytes)
    record: dict[str, Any] = {
        "outcome": "",
        "reason": "",
        "seconds": round(ended.seconds, 3),
        "cpu": round(ended.cpu, 3),
        "megabytes": round(ended.megabytes),
    }
    if case is not None:
        record.update(scope=case.scope, content=case.content, handles=len(case.wishes))
    if report.exists():
        told = json.loads(report.read_text(encoding="utf-8"))
        record.update(vertices=told["vertices"], notes=[note.split(" ")[1] for note in told["notes"]])
        record["stages"] = {stage: round(value, 2) for stage, value in told["seconds"].items() if value > 0.5}
    record.update(sweep_verdict.judge(ended, case, before, own, rng, settings))
    # A run that its time limit ended may go on in a second run.
    if record["outcome"] == "reshaped" and "time" not in record["notes"] and rng.random() < settings.lasting:
        record["lasting"] = sweep_lasting.faults(own, arguments[:-2], settings.limit, settings.megabytes)
        if record["lasting"]:
            record.update(outcome="unverified", reason=record["lasting"][0])
    if record["outcome"] not in (*GOOD, "refused") and settings.keep:
        _keep(job, own, arguments, record, settings.keep)
    return record


def _keep(job: Job, own: Path, arguments: list[str], record: dict[str, Any], folder: Path) -> None:
    """Keep the files that are needed to examine a defect."""
    name = re.sub(r"\W+", "_", f"{job.key}-{job.kind}-{job.seed}")[-120:]
    kept = folder / record["outcome"].replace(" ", "-") / name
    kept.mkdir(parents=True, exist_ok=True)
    for path in own.iterdir():
        if path.is_file():
            shutil.copy(path, kept)
    words = [word for word in arguments if word.startswith("--id=")]
    (kept / "run.json").write_text(json.dumps({**record, "arguments": words}, indent=1), encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
