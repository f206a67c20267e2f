# SPDX-License-Identifier: Apache-2.0
"""One map from many flights: each recording is flown by itself, in parallel, then maps are joined two by two, as a tree.

  python -m fbvins.fleet monday.mcap tuesday.mcap hall/*.mcap --out OUT --workers 4
  python -m fbvins.fleet flights/* --out /shared/OUT --dask tcp://scheduler:8786 --frontend orb --final-ba

OUT/map.fbm is the map, OUT/fleet.json says which flights are in it and which are not, and why. Flights need not begin in the same place; where
they lie to one another follows from the places that they have in common. Everything that is finished is kept in OUT: a fleet that was
interrupted goes on where it was, a task whose worker died is done by another one. The bytes do not depend on the number of workers.
"""
from __future__ import annotations

import argparse
import contextlib
import hashlib
import json
import os
import shutil
import subprocess
import sys
from typing import NamedTuple, Sequence

from .bench import dask_client


class Part(NamedTuple):
    """A map, and the flights that are in it."""

    key: str
    map: str  #: file; empty where the flight gave none
    flights: tuple[int, ...]  #: numbers of the recordings
    why: str = ""  #: why it is not joined to others


def key_of(*words: str) -> str:
    return hashlib.sha256("\0".join(words).encode()).hexdigest()[:16]


def fingerprint(recording: str) -> str:
    """Names and sizes of a recording's files."""
    if not os.path.isdir(recording):
        return str(os.path.getsize(recording)) if os.path.exists(recording) else "missing"
    sizes = []
    for folder, folders, files in os.walk(recording):
        folders.sort()
        sizes += [f"{os.path.relpath(os.path.join(folder, file), recording)}:{os.path.getsize(os.path.join(folder, file))}" for file in sorted(files)]
    return key_of(*sizes)


@contextlib.contextmanager
def _finished_as(path: str):
    """A name to write to, which becomes `path` at the end; what another worker finished first stays."""
    os.makedirs(os.path.dirname(path), exist_ok=True)
    part = f"{path}.{os.urandom(4).hex()}.part"
    try:
        yield part
        if os.path.exists(part) and not os.path.exists(path):
            os.replace(part, path)
    finally:
        if os.path.isdir(part):
            shutil.rmtree(part, ignore_errors=True)
        elif os.path.exists(part):
            os.remove(part)


def _last_line(done: subprocess.CompletedProcess) -> str:
    return (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]


def fly(program: str, version: str, recording: str, number: int, out: str, further: Sequence[str] = ()) -> Part:
    """The map of one recording, by `fbvins run`; returns at once where it was made before."""
    key = key_of("flight", version, os.path.abspath(recording), fingerprint(recording), *further)
    file = os.path.join(out, "flights", f"{key}.fbm")
    if not os.path.exists(file):
        with _finished_as(file) as part, _finished_as(os.path.join(out, "runs", key)) as folder:
            os.makedirs(folder)
            done = subprocess.run([program, "run", recording, "--out", folder, "--save-map", part, "--quiet", *further], capture_output=True,
                                  text=True, check=False)
            if done.returncode != 0 or not os.path.exists(part):
                shutil.rmtree(folder)
                return Part(key, "", (number,), _last_line(done))
    return Part(key, file, (number,))


def _joined(program: str, version: str, first: Part, second: Part, out: str) -> Part | str:
    """Both in one map, or why they are not."""
    key = key_of("merge", version, first.key, second.key)
    file, refusal = os.path.join(out, "merges", f"{key}.fbm"), os.path.join(out, "merges", f"{key}.txt")
    if not os.path.exists(file) and not os.path.exists(refusal):
        with _finished_as(file) as part, _finished_as(refusal) as text:
            done = subprocess.run([program, "map", "merge", first.map, second.map, "-o", part, "--leave-out"], capture_output=True, text=True,
                                  check=False)
            if done.returncode not in (0, 1):
                raise RuntimeError(_last_line(done))
            if done.returncode == 1:
                with open(text, "w", encoding="utf-8") as words:
                    words.write(_last_line(done).replace(f"{second.map}: ", "").replace("fbvins: warning: ", "").replace("; it is left out", ""))
    if os.path.exists(file):
        return Part(key, file, first.flights + second.flights)
    with open(refusal, encoding="utf-8") as words:
        return words.read()


def join(program: str, version: str, first: Sequence[Part], second: Sequence[Part], out: str) -> list[Part]:
    """The parts of two sides, those that belong together joined. Pairs of one side were tried before."""
    parts, tried = [*first, *second], {(a.key, b.key) for side in (first, second) for a in side for b in side}
    while True:
        for i, j in ((i, j) for i in range(len(parts)) for j in range(i + 1, len(parts))):
            a, b = parts[i], parts[j]
            if not a.map or not b.map or (a.key, b.key) in tried:
                continue
            tried.add((a.key, b.key))
            both = _joined(program, version, a, b, out)
            if isinstance(both, Part):
                parts[i] = both
                del parts[j]
                break
            parts[j] = b._replace(why=both)
        else:
            return parts


def build(client, program: str, recordings: Sequence[str], out: str, further: Sequence[str] = ()) -> list[Part]:
    """Flies all recordings and joins their maps on the workers of a distributed.Client; the parts, that with the most flights first."""
    version = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout.strip()

    def submit(task, *arguments):
        return client.submit(task, *arguments, key=f"fbvins-fleet-{task.__name__}-{os.urandom(8).hex()}", pure=False)

    level = [submit(_fly_alone, program, version, recording, number, out, tuple(further)) for number, recording in enumerate(recordings)]
    while len(level) > 1:
        pairs = [submit(join, program, version, level[i], level[i + 1], out) for i in range(0, len(level) - 1, 2)]
        level = pairs + level[len(level) - len(level) % 2:]
    parts = level[0].result()
    _sweep(out)
    return sorted(parts, key=lambda part: (not part.map, -len(part.flights), part.flights))


def _sweep(out: str) -> None:
    """Removes what killed workers left behind."""
    for folder in ("flights", "runs", "merges"):
        path = os.path.join(out, folder)
        for name in os.listdir(path) if os.path.isdir(path) else []:
            if name.endswith(".part"):
                left = os.path.join(path, name)
                shutil.rmtree(left, ignore_errors=True) if os.path.isdir(left) else os.remove(left)


def _fly_alone(*arguments) -> list[Part]:
    return [fly(*arguments)]


def write_result(parts: Sequence[Part], recordings: Sequence[str], out: str) -> None:
    """map.fbm and fleet.json. ValueError where no flight gave a map."""
    result = {"flights": [], "left_out": []}
    for part in parts:
        for number in part.flights:
            if part is parts[0] and part.map:
                result["flights"].append(recordings[number])
            else:
                result["left_out"].append({"recording": recordings[number], "why": part.why or "it has no place in common with the others"})
    if not parts[0].map:
        raise ValueError(f"no flight gave a map: {parts[0].why}")
    for name, write in (("map.fbm", lambda file: shutil.copyfile(parts[0].map, file)), ("fleet.json", lambda file: _write_json(file, result))):
        file = os.path.join(out, name)
        write(file + ".part")
        os.replace(file + ".part", file)


def _write_json(file: str, value) -> None:
    with open(file, "w", encoding="utf-8") as text:
        json.dump(value, text, indent=2)
        text.write("\n")


@contextlib.contextmanager
def _client(known):
    if known.dask:
        with dask_client(known.dask) as client:
            yield client
        return
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        raise ValueError("fbvins.fleet needs the package 'distributed': pip install distributed") from None
    with LocalCluster(n_workers=known.workers, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=None) as cluster:
        with Client(cluster) as client:
            yield client


def parse(arguments: Sequence[str] | None):
    parser = argparse.ArgumentParser(prog="python -m fbvins.fleet", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter,
                                     epilog="Further options are those of `fbvins run`, such as --frontend orb.")
    parser.add_argument("recordings", metavar="RECORDING", nargs="+", help="as for fbvins run; their order decides whose frame is the map's")
    parser.add_argument("--out", required=True, help="folder for the map and all that is finished, shared by all machines")
    parser.add_argument("--program", default=os.environ.get("FBVINS") or shutil.which("fbvins"), help="fbvins (default: $FBVINS, or that of PATH)")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--dask", metavar="ADDRESS", help="of a Dask scheduler, such as tcp://HOST:8786")
    where.add_argument("--workers", type=int, default=2, help="processes on this machine (default 2)")
    known, further = parser.parse_known_args(arguments)
    if not known.program:
        parser.error("there is no program fbvins on PATH: --program")
    if known.workers < 1:
        parser.error("--workers: one at least")
    return known, further


def main(arguments: Sequence[str] | None = None) -> int:
    known, further = parse(arguments)
    out, recordings = os.path.abspath(known.out), [os.path.abspath(recording) for recording in known.recordings]
    try:
        with _client(known) as client:
            parts = build(client, os.path.abspath(known.program), recordings, out, further)
        write_result(parts, recordings, out)
    except (ValueError, RuntimeError) as error:
        print(error, file=sys.stderr)
        return 2
    print(f"{os.path.join(out, 'map.fbm')}: {len(parts[0].flights)} of {len(recordings)} flights")
    return 0


if __name__ == "__main__":
    sys.exit(main())
