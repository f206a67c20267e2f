# SPDX-License-Identifier: Apache-2.0
"""A matrix of experiments on many machines: every cell of `fbvins bench` as a task of Dask, or of a Slurm array.

  python -m fbvins.bench scenarios.yaml --out /shared/scenarios --dask tcp://scheduler:8786
  python -m fbvins.bench scenarios.yaml --out /shared/scenarios --slurm | sbatch

All machines need the matrix, the recordings and OUT under the same paths, and the same build of `fbvins`. A cell whose worker dies is done by
another one; a cell is done once, however many workers try it. The tables are those of `fbvins bench` alone.
"""
from __future__ import annotations

import argparse
import asyncio
import os
import shlex
import shutil
import subprocess
import sys
from typing import NamedTuple, Sequence


#: Time for a scheduler to answer.
CONNECT_S = 10


class CellEnd(NamedTuple):
    """Result of a cell."""

    cell: str
    exit_code: int
    said: str  #: output on stderr; empty on success


def bench_command(program: str, matrix: str, out: str, further: Sequence[str] = ()) -> list[str]:
    """`fbvins bench` on that matrix; further: its own options, such as --euroc."""
    return [program, "bench", matrix, "--out", out, *further]


def list_cells(command: Sequence[str]) -> list[str]:
    """Names of all cells, in the order of the tables."""
    listed = subprocess.run([*command, "--list"], capture_output=True, text=True, check=False)
    if listed.returncode != 0:
        raise ValueError(listed.stderr.strip())
    return listed.stdout.split()


def run_cell(command: Sequence[str], cell: str) -> CellEnd:
    """Runs one cell on this machine; returns at once where it was done before."""
    done = subprocess.run([*command, "--cell", cell, "--quiet"], capture_output=True, text=True, check=False)
    return CellEnd(cell, done.returncode, done.stderr.strip())


def run_on_dask(client, command: Sequence[str]) -> list[CellEnd]:
    """All cells on the workers of a distributed.Client, a task each. The scheduler gives a cell whose worker died to another one, and gives up
    after several deaths (distributed.scheduler.allowed-failures)."""
    from distributed import as_completed

    cells = list_cells(command)
    futures = {client.submit(run_cell, list(command), cell, key=f"fbvins-{cell}-{os.urandom(4).hex()}", pure=False): cell for cell in cells}
    ends = {}
    for future in as_completed(list(futures)):
        cell = futures[future]
        error = future.exception()  # of the task itself, such as when its workers died too often
        ends[cell] = CellEnd(cell, -1, str(error)) if error else future.result()
        print(f"{len(ends)}/{len(cells)} cells  {cell}  {ends[cell].said or 'done'}", file=sys.stderr)
    return [ends[cell] for cell in cells]


def write_tables(command: Sequence[str]) -> int:
    """Writes the tables of the finished matrix; failed cells are tried once more, on this machine. The exit code is that of `fbvins bench`."""
    return subprocess.run(list(command), check=False).returncode


def slurm_script(command: Sequence[str], name: str = "fbvins-bench") -> str:
    """An array job for sbatch, one task per cell. When it has finished, `fbvins bench` without --cell writes the tables."""
    words = shlex.join(command)
    return f"""#!/bin/bash
#SBATCH --job-name={name}
#SBATCH --array=1-{len(list_cells(command))}
#SBATCH --cpus-per-task=2
#SBATCH --requeue
# For the tables, once the array has finished: sbatch --dependency=afterany:JOB --wrap {shlex.quote(words)}
cell=$({words} --list | sed -n "${{SLURM_ARRAY_TASK_ID}}p")
exec {words} --cell "$cell"
"""


def dask_client(address: str):
    """A distributed.Client. ValueError with one sentence where the package is missing or no scheduler answers."""
    try:
        from distributed import Client
    except ImportError:
        raise ValueError("--dask needs the package 'distributed': pip install distributed") from None
    try:
        return Client(address, timeout=CONNECT_S)
    except (OSError, TimeoutError, asyncio.TimeoutError) as error:
        raise ValueError(f"--dask {address}: no scheduler answers there within {CONNECT_S} s ({type(error).__name__})") from None


def parse(arguments: Sequence[str] | None):
    parser = argparse.ArgumentParser(prog="python -m fbvins.bench", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter,
                                     epilog="Further options are those of `fbvins bench`, such as --euroc DIR.")
    parser.add_argument("matrix", metavar="MATRIX", help="YAML file, as for fbvins bench")
    parser.add_argument("--out", required=True, help="folder for the results, shared by all machines")
    parser.add_argument("--program", default=os.environ.get("FBVINS") or shutil.which("fbvins"), help="fbvins (default: $FBVINS, or that of PATH)")
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--dask", metavar="ADDRESS", help="of a Dask scheduler, such as tcp://HOST:8786")
    where.add_argument("--slurm", action="store_true", help="print the array job for sbatch")
    known, further = parser.parse_known_args(arguments)
    if not known.program:
        parser.error("there is no program fbvins on PATH: --program")
    return known, further


def main(arguments: Sequence[str] | None = None) -> int:
    known, further = parse(arguments)
    command = bench_command(os.path.abspath(known.program), os.path.abspath(known.matrix), os.path.abspath(known.out), further)
    try:
        if known.slurm:
            print(slurm_script(command), end="")
            return 0
        with dask_client(known.dask) as client:
            run_on_dask(client, command)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    return write_tables(command)


if __name__ == "__main__":
    sys.exit(main())
