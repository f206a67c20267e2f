#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""An installed wheel at work: a small flight is rendered, estimated and mapped; recordings and results are written and read; stubs have their
docstrings. ./dev wheel runs it in a new environment with nothing but NumPy, as a user without a compiler has it."""
import pathlib
import sys
import tempfile

import numpy
import fbvins


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
        assert isinstance(run.p, numpy.ndarray) and run.covariance.shape[1:] == (6, 6)
    print(f"fbvins {fbvins.__version__}, Python {sys.version.split()[0]}, NumPy {numpy.__version__}: {error * 1e3:.2f} mm, p_end {run.p[-1].tolist()}")


if __name__ == "__main__":
    main()
