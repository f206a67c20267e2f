# SPDX-License-Identifier: Apache-2.0
"""An EuRoC recording's IMU and truth in a flight controller's coordinate frames, and the trajectory that FBVINS estimates."""
import csv
import pathlib

import numpy as np

GRAVITY_MPS2 = 9.81
# EuRoC's IMU has x up, y right, z forward. Rows: the vehicle's forward, right and down, seen in it.
R_FB = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
MOUNTING = ["live.mavlink.mounting.imu_axes=camera_fwd", "live.mavlink.mounting.roll_rad=-1.5707963268"]
Z_DOWN = np.diag([1.0, -1, -1])  # between worlds with z up and z down


def rotation(q_wxyz):
    w, x, y, z = q_wxyz / np.linalg.norm(q_wxyz)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def about_z(angle_rad):
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def rows(path):
    with open(path, encoding="utf-8") as file:
        return [row for row in csv.reader(file) if row and not row[0].startswith("#")]


class Recording:
    def __init__(self, folder):
        folder = pathlib.Path(folder) / "mav0"
        imu = rows(folder / "imu0" / "data.csv")
        self.imu_ns = np.array([int(row[0]) for row in imu])
        readings = np.array([[float(v) for v in row[1:7]] for row in imu])
        self.gyro_B, self.gyro, self.accel = readings[:, :3], readings[:, :3] @ R_FB.T, readings[:, 3:] @ R_FB.T
        truth = rows(folder / "state_groundtruth_estimate0" / "data.csv")
        self.truth_ns = np.array([int(row[0]) for row in truth])
        values = np.array([[float(v) for v in row[1:17]] for row in truth])
        # Of the vehicle in a world with z down.
        self.p = values[:, :3] @ Z_DOWN
        self.R = np.array([Z_DOWN @ rotation(q) @ R_FB.T for q in values[:, 3:7]])
        self.gyro_bias, self.accel_bias = R_FB @ values[0, 10:13], R_FB @ values[0, 13:16]

    def truth(self, t_ns):
        """Position by interpolation, attitude of the nearest row (5 ms)."""
        p = np.array([np.interp(t_ns, self.truth_ns, self.p[:, axis]) for axis in range(3)])
        nearest = min(np.searchsorted(self.truth_ns, t_ns), len(self.truth_ns) - 1)
        return p, self.R[nearest]

    def at_rest(self):
        """What this IMU would read if the vehicle stood still as it first hangs."""
        return self.truth(self.imu_ns[0])[1].T @ np.array([0, 0, -GRAVITY_MPS2]) + self.accel_bias, self.gyro_bias


class Trajectory:
    """trajectory.csv of `fbvins run`."""

    def __init__(self, path, recording):
        self.poses = []
        for row in rows(path):
            t_ns, state = int(row[0]), row[-3]
            w_WB_B = recording.gyro_B[np.searchsorted(recording.imu_ns, t_ns).clip(0, len(recording.imu_ns) - 1)]
            values = np.nan_to_num(np.array([float(v) for v in row[1:-3]]))  # of frames without a pose NaN
            covariance = values[16:37]
            sigmas = [np.sqrt(max(covariance[[0, 6, 11]])), np.sqrt(max(covariance[[15, 18, 20]])), 0.05]
            self.poses.append({"t_ns": t_ns, "state": state, "resets": int(row[-1]), "p": values[:3], "q": values[3:7], "v": values[7:10],
                               "w": w_WB_B, "sigmas": sigmas})
