#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""An installed wheel at work: a small flight is rendered, estimated and mapped; recordings and results are written and read; the command `fbvins`
gives the same; stubs have their docstrings. ./dev wheel runs it in a new environment with nothing but NumPy, as a user without a compiler has it."""
import pathlib
import subprocess
import sys
import tempfile

import numpy
import fbvins


def try_programs(folder):
    """The command that pip has put beside Python: its programs, data, page and bridges are in the package."""
    def fbvins_says(*arguments, code=0):
        done = subprocess.run([sys.executable, "-c", "import sys; from fbvins._program import main; main()", *map(str, arguments)], capture_output=True, text=True, check=False)
        assert done.returncode == code, (arguments, done)
        return done.stdout + done.stderr

    assert fbvins_says("--version").startswith(f"fbvins {fbvins.__version__}\n")
    fbvins_says("simulate", "normal", "--seconds", "4", "--seed", "1", "--quiet", "--out", folder / "flight")
    fbvins.run(str(folder / "flight"), frontend="boost").save(str(folder / "by_module"))
    fbvins_says("run", folder / "flight", "--frontend", "boost", "--out", folder / "by_program", "--quiet")
    assert (folder / "by_program" / "trajectory_tum.txt").read_bytes() == (folder / "by_module" / "trajectory_tum.txt").read_bytes()
    fbvins_says("info", folder / "flight.bag")
    fbvins_says("target", "--out", folder / "board")
    assert "pip install" in fbvins_says("live", "--source", "oak", code=2), "the bridges are in the package"
    assert "--web" in fbvins_says("live", "--help"), "the page is built in"


def main():
    package = pathlib.Path(fbvins.__file__).parent
    stubs = (package / "_fbvins.pyi").read_text(encoding="utf-8")
    assert (package / "py.typed").exists() and "def push_images" in stubs and "t in ns of the cameras' clock" in stubs, "stubs with docstrings"
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        recording = fbvins.simulate("normal", seed=1, seconds=6)
        assert recording.rig.left.width == 752
        run = fbvins.run(recording, frontend="orb", loop=True)
        assert run.has_pose.sum() > 60 and run.map_trajectory is not None
        error = fbvins.evaluate(run.ground_truth, run).absolute_m.rmse
        assert error < 0.05, error
        run.save(str(folder / "out"))
        fbvins.report([run], folder / "report.html")
        fbvins.convert(fbvins.simulate("normal", seed=1, seconds=3), str(folder / "flight.bag"))
        again = fbvins.run(str(folder / "flight.bag"), frontend="boost")
        assert len(again) > 40 and fbvins.info(str(folder / "flight.bag"))["imu"]
        try_programs(folder)
        assert isinstance(run.p, numpy.ndarray) and run.covariance.shape[1:] == (6, 6)
    print(f"fbvins {fbvins.__version__}, Python {sys.version.split()[0]}, NumPy {numpy.__version__}: {error * 1e3:.2f} mm, p_end {run.p[-1].tolist()}")


if __name__ == "__main__":
    main()
