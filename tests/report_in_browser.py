#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Opens a report from disk in headless Chromium: there is no error, every plot is drawn, the figures are those of the run, in the
light and the dark theme.

usage: report_in_browser.py FBVINS      exit 77 where there is no Chromium (Debian: apt-get install chromium)
"""
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import browser

PROGRAM = sys.argv[1]
BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


def fbvins(*arguments):
    subprocess.run([PROGRAM, *map(str, arguments), "--quiet"], check=True, timeout=600)


def opened(page, theme, profile):
    """The page's elements after its script has run."""
    command = [BROWSER, "--headless=new", "--no-sandbox", "--disable-gpu", "--window-size=1400,1200", f"--user-data-dir={profile}",
               "--virtual-time-budget=10000", "--dump-dom", f"file://{page}#{theme}"]
    return subprocess.run(command, check=True, timeout=300, capture_output=True, text=True, encoding="utf-8").stdout


def check(dom, runs, theme):
    html = re.search(r"<html[^>]*>", dom)[0]
    assert "data-error" not in html, html
    assert f'data-theme="{theme}"' in html, html
    ready = re.search(r'data-ready="(\d+)"', html)
    assert ready, "the page's script did not reach its end: " + html
    plots = re.findall(r"<svg[^>]*>", dom)
    assert len(plots) == int(ready[1]) >= 15, (len(plots), ready[1])
    empty = [p for p in plots if int((re.search(r'data-points="(\d+)"', p) or [0, 0])[1]) < 2]
    assert not empty, empty
    assert "NaN" not in re.sub(r"(?s)<script.*?</script>", "", dom), "a coordinate of a plot is not a number"
    table = re.search(r'(?s)<div class="card" id="table1".*?</table>', dom)[0]
    for run in runs:
        error = json.loads((run / "summary.json").read_text(encoding="utf-8"))["result"]["accuracy"]["ape_m"]
        for name in ("max", "mean", "median", "rmse", "std"):
            assert f">{error[name]:.4f}<" in table, (run.name, name, error[name], table)


def check_layout(page, runs):
    """At every width all columns of tables are seen and all axes are named; legends name only what is there."""
    states = {state for run in runs for state in json.loads((run / "summary.json").read_text(encoding="utf-8"))["result"]["health"]}
    with browser.Browser() as chromium:
        for width in (1400, 1000, 700, 480):
            shown = chromium.open(f"file://{page}#light", width=width, height=1000)
            shown.wait_for("document.documentElement.dataset.ready")
            cut = shown.value("JSON.stringify([...document.querySelectorAll('.scroll')].filter(s => s.scrollWidth > s.clientWidth + 1).map(s => s.innerText.slice(0, 60)))")
            assert json.loads(cut) == [], f"columns are cut off at {width} px: {cut}"
            bare = shown.value("JSON.stringify([...document.querySelectorAll('svg')].map(s => s.dataset.axes || '').filter(a => !/^[^|]+ \\| .+$/.test(a)))")
            assert json.loads(bare) == [], f"axes without names: {bare}"
        unnamed = shown.value("[...document.querySelectorAll('svg.plot')].filter(s => !s.querySelector('.axis-name')?.textContent).length")
        assert unnamed == 0, unnamed
        legend = set(json.loads(shown.value("JSON.stringify([...document.querySelectorAll('.legend i.block')].map(i => i.parentElement.textContent))")))
        names = {"good": "good", "degraded": "degraded", "lost": "lost", "initialising": "not started"}
        assert legend == {names[state.split("/")[0]] for state in states}, (legend, states)


def main():
    if not BROWSER:
        print("skipped: no Chromium here to open the report with")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        fbvins("simulate", "normal", "--seconds", "4", "--set", "image_rate_hz=10", "--out", folder / "flight")
        runs = [folder / "klt", folder / "orb"]
        for run in runs:
            fbvins("run", folder / "flight", "--frontend", run.name, "--out", run)
        fbvins("report", *runs, "--out", folder / "report.html")
        for theme in ("light", "dark"):
            check(opened(folder / "report.html", theme, folder / "profile"), runs, theme)
        check_layout(folder / "report.html", runs)
    print("the report opens, draws every plot and shows the right figures, light and dark")
    return 0


if __name__ == "__main__":
    sys.exit(main())
