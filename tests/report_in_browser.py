#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Opens a report from disk in headless Chromium: there is no error, every plot is drawn, the figures are those of the run, in the
light and the dark theme.

usage: report_in_browser.py FBVINS      exit 77 where there is no Chromium (Debian: apt-get install chromium)
"""
import json
import pathlib
import re
import subprocess
import sys
import tempfile

import browser
import page_checks

PROGRAM = sys.argv[1]


def fbvins(*arguments):
    subprocess.run([PROGRAM, *map(str, arguments), "--quiet"], check=True, timeout=600)


def check_runs(dom, runs):
    table = re.search(r'(?s)<div class="card" id="table1".*?</table>', dom)[0]
    for run in runs:
        error = json.loads((run / "summary.json").read_text(encoding="utf-8"))["result"]["accuracy"]["ape_m"]
        for name in ("max", "mean", "median", "rmse", "std"):
            assert f">{error[name]:.4f}<" in table, (run.name, name, error[name], table)


def check_legend(shown, runs):
    """Legends name only what is there."""
    states = {state for run in runs for state in json.loads((run / "summary.json").read_text(encoding="utf-8"))["result"]["health"]}
    legend = set(json.loads(shown.value("JSON.stringify([...document.querySelectorAll('.legend i.block')].map(i => i.parentElement.textContent))")))
    names = {"good": "good", "degraded": "degraded", "lost": "lost", "initialising": "not started"}
    assert legend == {names[state.split("/")[0]] for state in states}, (legend, states)


def runs_of(folder):
    fbvins("simulate", "normal", "--seconds", "4", "--set", "image_rate_hz=10", "--out", folder / "flight")
    runs = [folder / "klt", folder / "orb"]
    for run in runs:
        fbvins("run", folder / "flight", "--frontend", run.name, "--out", run)
    fbvins("report", *runs, "--out", folder / "report.html")
    return runs


def main():
    if not browser.PROGRAM:
        print("skipped: no Chromium here to open the report with")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        runs = runs_of(folder)
        with browser.Browser() as chromium:
            for theme in ("light", "dark"):
                check_runs(page_checks.drawn(chromium, folder / "report.html", theme, 15), runs)
            check_legend(page_checks.check_layout(chromium, folder / "report.html"), runs)
    print("the report opens, draws every plot and shows the right figures, light and dark")
    return 0


if __name__ == "__main__":
    sys.exit(main())
