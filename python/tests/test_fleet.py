# SPDX-License-Identifier: Apache-2.0
"""One map from several flights: the same bytes with one and with two workers of which one is killed, nothing done twice, strangers left out."""
import json
import os
import signal
import subprocess
import threading
import time

import pytest

import fbvins
from fbvins import fleet

OPTIONS = ("--frontend", "orb")


@pytest.fixture(scope="module")
def flights(program, tmp_path_factory):
    """Two parts of one rendered flight, and a flight in another room."""
    root = tmp_path_factory.mktemp("flights")
    simulate = ["simulate", "normal", "--set", "image_rate_hz=10", "--set", "camera.time_samples=1", "--quiet"]
    for name, seed, seconds in (("whole", 1, 7), ("stranger", 2, 3)):
        subprocess.run([program, *simulate, "--seed", str(seed), "--seconds", str(seconds), "--out", str(root / name)], check=True)
    for name, start in (("first", 0), ("second", 3)):
        fbvins.convert(fbvins.open(root / "whole", start_s=start, duration_s=4), root / name)
    return [str(root / name) for name in ("first", "stranger", "second")]


def finished(out):
    return {str(path.relative_to(out)): path.stat().st_mtime_ns for path in out.rglob("*.fbm") if path.name != "map.fbm"}


def test_any_number_of_workers_and_a_killed_one_give_the_same_map(program, flights, tmp_path):
    distributed = pytest.importorskip("distributed")
    alone, together = tmp_path / "alone", tmp_path / "together"
    assert fleet.main([*flights, "--out", str(alone), "--workers", "1", "--program", program, *OPTIONS]) == 0
    result = json.loads((alone / "fleet.json").read_text(encoding="utf-8"))
    assert result["flights"] == [flights[0], flights[2]]
    assert [left["recording"] for left in result["left_out"]] == [flights[1]]
    assert result["left_out"][0]["why"] == "the two maps have no place in common"
    assert "2 sessions" in subprocess.run([program, "map", "info", str(alone / "map.fbm")], capture_output=True, text=True, check=True).stdout

    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=None) as cluster:
        with distributed.Client(cluster) as client:
            workers = list(client.run(os.getpid).values())

            def kill_one():
                while not (together / "flights").exists():
                    time.sleep(0.01)
                os.kill(workers[0], signal.SIGKILL)

            killer = threading.Thread(target=kill_one)
            killer.start()
            parts = fleet.build(client, program, flights, str(together), OPTIONS)
            killer.join()
    fleet.write_result(parts, flights, str(together))
    for name in ("map.fbm", "fleet.json"):
        assert (together / name).read_bytes() == (alone / name).read_bytes()
    assert set(finished(together)) == set(finished(alone))
    before = finished(alone)
    (alone / "map.fbm").unlink()
    assert fleet.main([*flights, "--out", str(alone), "--workers", "1", "--program", program, *OPTIONS]) == 0
    assert finished(alone) == before  # nothing was done again
    assert not list(tmp_path.rglob("*.part"))


def test_flights_without_a_map_are_told(program, tmp_path, capsys):
    pytest.importorskip("distributed")
    assert fleet.main([str(tmp_path / "none"), "--out", str(tmp_path / "out"), "--workers", "1", "--program", program]) == 2
    assert "none" in capsys.readouterr().err
