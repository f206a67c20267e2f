# SPDX-License-Identifier: Apache-2.0
"""A matrix on many processes, of which one is killed: the same table, no cell lost, none done twice."""
import csv
import os
import signal
import subprocess
import threading
import time

import pytest

from fbvins import bench

MATRIX = """title: Short flights
datasets:
  - simulate: {preset: normal, seconds: 2, seeds: 3, set: [image_rate_hz=10]}
frontends: [klt, orb]
"""
#: Columns that differ from run to run.
TIMES = {"cpu_ms", "cpu_p99_ms", "peak_mb"}


@pytest.fixture(scope="module")
def matrix(tmp_path_factory):
    path = tmp_path_factory.mktemp("matrix") / "matrix.yaml"
    path.write_text(MATRIX)
    return str(path)


@pytest.fixture(scope="module")
def alone(program, matrix, tmp_path_factory):
    """The table of `fbvins bench` by itself, and what was rendered for it."""
    out = tmp_path_factory.mktemp("alone")
    subprocess.run([program, "bench", matrix, "--out", str(out), "--jobs", "2", "--quiet"], check=True)
    return out


def table(out):
    with open(out / "results.csv", encoding="utf-8", newline="") as file:
        return [{k: v for k, v in row.items() if k not in TIMES} for row in csv.DictReader(file)]


def finished(out):
    return {path.parent.name: path.stat().st_mtime_ns for path in (out / "cells").glob("*/cell.json")}


def test_a_killed_worker_costs_nothing(program, matrix, alone, tmp_path):
    distributed = pytest.importorskip("distributed")
    command = bench.bench_command(program, matrix, str(tmp_path))
    with distributed.LocalCluster(n_workers=3, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=None) as cluster:
        with bench.dask_client(cluster.scheduler_address) as client:
            killed = []

            def kill_one():
                """Kills a worker that is busy, as soon as the first cell is finished."""
                while not finished(tmp_path):
                    time.sleep(0.02)
                busy = [worker for worker, tasks in client.processing().items() if tasks]
                pid = client.run(os.getpid, workers=busy[:1])[busy[0]]
                os.kill(pid, signal.SIGKILL)
                killed.append(pid)

            killer = threading.Thread(target=kill_one)
            killer.start()
            ends = bench.run_on_dask(client, command)
            killer.join()
    assert len(killed) == 1
    assert [(end.cell, end.exit_code) for end in ends] == [(cell, 0) for cell in bench.list_cells(command)]
    before = finished(tmp_path)
    assert len(before) == 6
    assert bench.write_tables(command) == 0
    assert finished(tmp_path) == before  # nothing was done again
    assert [row["trajectory_hash"] for row in table(tmp_path)] == [row["trajectory_hash"] for row in table(alone)]
    assert table(tmp_path) == table(alone)


def test_a_slurm_array_gives_the_same_table(program, matrix, alone, tmp_path):
    """Tasks of the array in any order, one of them twice at a time, by bash."""
    further = ["--rendered", str(alone / "rendered")]
    script = bench.slurm_script(bench.bench_command(program, matrix, str(tmp_path), further))
    assert "#SBATCH --array=1-6\n" in script

    def start(task):
        return subprocess.Popen(["bash", "-s"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
                                env={**os.environ, "SLURM_ARRAY_TASK_ID": str(task)})

    said = []
    for tasks in ((6, 6), (5, 1), (3,), (2, 4)):
        running = [start(task) for task in tasks]
        said += [process.communicate(script)[0] for process in running]
        assert all(process.returncode == 0 for process in running)
    assert sorted(line.split(": ")[1] for line in said) == ["done\n"] * 6 + ["was done before\n"]
    before = finished(tmp_path)
    subprocess.run(bench.bench_command(program, matrix, str(tmp_path), [*further, "--quiet"]), check=True)
    assert finished(tmp_path) == before
    assert table(tmp_path) == table(alone)


def test_a_missing_matrix_or_cell_is_one_message(program, matrix, tmp_path, capsys):
    assert bench.main([str(tmp_path / "none.yaml"), "--out", str(tmp_path), "--program", program, "--slurm"]) == 2
    assert "none.yaml" in capsys.readouterr().err
    done = subprocess.run([program, "bench", matrix, "--out", str(tmp_path), "--cell", "normal-9s-klt"], capture_output=True, text=True, check=False)
    assert done.returncode == 2 and "there is no cell 'normal-9s-klt'" in done.stderr
