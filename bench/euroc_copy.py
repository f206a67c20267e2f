# SPDX-License-Identifier: Apache-2.0
"""A recording in EuRoC's layout whose stamps (ns), readings and declared noise are changed; its images are links."""
import os
import pathlib
import re
import shutil

import numpy as np


class Copy:
    def __init__(self, folder, cameras=None):
        """Of the first `cameras`, or all."""
        self.folder = pathlib.Path(folder)
        self.mav = self.folder / "mav0" if (self.folder / "mav0").exists() else self.folder
        self.stamps = {cam.name: [(int(t), file) for t, file, *_ in self.rows(f"{cam.name}/data.csv")] for cam in sorted(self.mav.glob("cam*"))[:cameras]}
        imu = self.rows("imu0/data.csv")
        self.t = np.array([int(r[0]) for r in imu])
        self.readings = np.array([[float(x) for x in r[1:7]] for r in imu])
        self.noise = {}  # factors on what sensor.yaml declares

    def rows(self, name):
        with open(self.mav / name, encoding="utf-8") as f:
            return [line.strip().split(",") for line in f if line.strip() and not line.startswith("#")]

    def write(self, out):
        shutil.rmtree(out, ignore_errors=True)
        mav = pathlib.Path(out) / "mav0"
        (mav / "imu0").mkdir(parents=True)
        text = (self.mav / "imu0/sensor.yaml").read_text(encoding="utf-8")
        for name, factor in self.noise.items():
            text = re.sub(rf"({name}:\s*)(\S+)", lambda m: f"{m.group(1)}{factor * float(m.group(2)):.6g}", text)
        (mav / "imu0/sensor.yaml").write_text(text, encoding="utf-8")
        readings = "".join(f"{t}," + ",".join(f"{x:.9g}" for x in row) + "\n" for t, row in zip(self.t, self.readings))
        (mav / "imu0/data.csv").write_text("#timestamp [ns],w_x,w_y,w_z,a_x,a_y,a_z\n" + readings, encoding="utf-8")
        for cam, stamps in self.stamps.items():
            (mav / cam).mkdir()
            os.symlink((self.mav / cam / "data").resolve(), mav / cam / "data")
            shutil.copyfile(self.mav / cam / "sensor.yaml", mav / cam / "sensor.yaml")
            (mav / cam / "data.csv").write_text("#timestamp [ns],filename\n" + "".join(f"{t},{file}\n" for t, file in stamps), encoding="utf-8")
        return out
