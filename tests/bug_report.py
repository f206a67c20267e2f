#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`fbvins bug-report`: what it gathers of a flight and its recording, and that no name of a person is in it.

usage: bug_report.py FBVINS      environment: FBVINS_SIMULATED_FLIGHT
"""
import json
import os
import pathlib
import socket
import subprocess
import sys
import tempfile


def main():
    program, flight = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(os.environ["FBVINS_SIMULATED_FLIGHT"])
    with tempfile.TemporaryDirectory() as folder:
        home = pathlib.Path(folder) / "home" / "marie-curie"
        (home / "secret-project").mkdir(parents=True)
        recording, out, report = home / "secret-project" / "lab", home / "secret-project" / "out", home / "report"
        recording.symlink_to(flight.resolve())
        environment = {**os.environ, "HOME": str(home)}

        def fbvins(*arguments, code=0):
            done = subprocess.run([program, *map(str, arguments)], env=environment, cwd=home, capture_output=True, text=True, check=False)
            assert done.returncode == code, done
            return done

        fbvins("run", recording, "--frontend", "klt", "--out", out, "--quiet")
        (out / "note.log").write_text(f"map {home}/secret-project/hall.fbm, record /media/marie-curie/stick/a.mcap, on {socket.gethostname()}\n")
        fbvins("bug-report", out, "--recording", recording, "--images", "--start", "2", "--out", report)

        names = {str(p.relative_to(report)) for p in report.rglob("*") if p.is_file()}
        assert {"report.md", "recording.json", "images.mcap", "flight/summary.txt", "flight/config.yaml", "flight/trajectory.csv"} <= names, names
        for name in names - {"images.mcap"}:
            text = (report / name).read_text(encoding="utf-8")
            assert "marie-curie" not in text and str(home) not in text, name
        note = (report / "flight/note.log").read_text()
        assert note == "map hall.fbm, record /media/USER/stick/a.mcap, on HOST\n", note
        page = (report / "report.md").read_text()
        for words in ("commit: ", "compiler: ", "cores", "coverage", "## Doctor", "images.mcap"):
            assert words in page, (words, page)

        small = json.loads(fbvins("info", report / "images.mcap", "--json").stdout)
        whole = json.loads(fbvins("info", recording, "--json").stdout)
        assert abs(small["frames"] - 200) <= 2, small
        assert small["left"]["width"] * 2 == whole["left"]["width"], (small["left"], whole["left"])
        fbvins("run", report / "images.mcap", "--frontend", "klt", "--out", home / "small", "--quiet")
        small = json.loads((home / "small/summary.json").read_text())["result"]
        assert small["coverage"]["share"] > 0.9 and small["accuracy"]["ape_m"]["rmse"] < 0.05, small

        assert "--out" in fbvins("bug-report", out, "--out", report, code=2).stderr  # it is there already
        assert "no file of" in fbvins("bug-report", home / "secret-project" / "lab", "--out", home / "other", code=2).stderr
        assert "--recording" in fbvins("bug-report", out, "--images", "--out", home / "third", code=2).stderr
        assert not (home / "third").exists()
        fbvins("bug-report", "--recording", home / "nothing.bag", "--out", home / "fourth")
        page = (home / "fourth/report.md").read_text()
        assert "nothing.bag" in page and str(home) not in page, page
    print("bug-report: flight, recording, doctor, small images; no names; refusals")


if __name__ == "__main__":
    main()
