#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A real PX4 navigates by FBVINS: its EKF2 gets the IMU of a recording, and the poses of `fbvins run` in the form in which the
MAVLink sink sends them, all in simulated time. PX4's own estimates are compared with the truth. FBVINS_PX4 names the program
(bin/px4 of a px4_sitl build).

usage: px4_flight.py FBVINS MAVLINK_SESSION_TEXT [PYTHON]    PYTHON: one that has pymavlink and numpy, when this one has not
"""
import contextlib
import os
import pathlib
import re
import subprocess
import sys
import tempfile

from other_python import needs

needs(["numpy", "pymavlink"], at=3)
import numpy as np  # noqa: E402
from flight_data import MOUNTING, Recording, Trajectory, about_z, rotation  # noqa: E402
from px4_simulator import Px4  # noqa: E402

BAR_M = 0.05
STEP_US = 5000
START_US = 1_000_000
STANDING_S = 58  # PX4 trusts a companion's clock after 500 answers, ten a second
CABLE_US = 60_000  # delay from the exposure of an image until its pose reaches the flight controller
HOST_AHEAD_NS = 7_000_000_000_000  # how far the companion computer's clock is ahead of PX4's


class Companion:
    """The MAVLink sink's session, in its own process and on its own clock."""

    def __init__(self, program, options=()):
        self.process = subprocess.Popen([program, *MOUNTING, *options], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def __call__(self, what, t_us, *values):
        print(what, t_us * 1000 + HOST_AHEAD_NS, *values, file=self.process.stdin, flush=True)
        return [bytes.fromhex(line) for line in iter(lambda: self.process.stdout.readline().strip(), ".")]

    def close(self):
        self.process.stdin.close()
        self.process.wait()
        self.process.stdout.close()


class Flight:
    """One flight. `deliver(pose, s)` returns the pose to send, or None for no pose; s: seconds since the first IMU reading."""

    def __init__(self, px4, companion, recording, trajectory, deliver):
        self.px4, self.companion, self.recording = px4, companion, recording
        self.ask_at, self.answers = {}, {}
        self.odometry, self.sent, self.said = [], [], []
        self.flight_us = START_US + int(STANDING_S * 1e6)
        self.waiting = [(self.to_us(pose["t_ns"]) + CABLE_US, pose) for pose in trajectory.poses]
        self.deliver, self.said_state = deliver, None

    def to_us(self, t_ns):
        return self.flight_us + int(t_ns - self.recording.imu_ns[0]) // 1000

    def seconds(self, t_us):
        return (t_us - self.flight_us) * 1e-6

    def run(self):
        rest = self.recording.at_rest()
        for t_us in range(START_US, self.flight_us, STEP_US):
            self.step(t_us, *rest)
        for t_ns, accel, gyro in zip(self.recording.imu_ns, self.recording.accel, self.recording.gyro):
            self.step(self.to_us(t_ns), accel, gyro)

    def step(self, t_us, accel, gyro):
        self.px4.step(t_us, accel, gyro)
        for packet in self.px4.receive():
            self.send(self.companion("bytes", t_us, packet.hex()))
            for message in self.px4.messages(packet):
                self.hear(message)
        while self.waiting and self.waiting[0][0] <= t_us:
            self.send_pose(self.waiting.pop(0)[1])
        self.send(self.companion("tick", t_us))
        for command in [c for s, c in list(self.ask_at.items()) if s <= self.seconds(t_us)]:
            self.answers[command] = self.px4.ask(*command.split())
            self.ask_at = {s: c for s, c in self.ask_at.items() if c != command}

    def send_pose(self, pose):
        t_us = self.to_us(pose["t_ns"])
        pose = self.deliver(dict(pose), self.seconds(t_us))
        if pose is None:
            return
        if pose["state"] != self.said_state:
            self.said_state = pose["state"]
            self.send(self.companion("health", t_us + CABLE_US, pose["state"]))
        self.send(self.companion("pose", t_us, pose["state"], pose["resets"], *pose["p"], *pose["q"], *pose["v"], *pose["w"],
                                 *pose["sigmas"]))

    def send(self, packets):
        for packet in packets:
            self.px4.send(packet)
            for message in self.px4.messages(packet):
                if message.get_type() == "ODOMETRY":
                    self.sent.append(message)
                elif message.get_type() == "STATUSTEXT":
                    self.said.append(message.text)

    def hear(self, message):
        # Only PX4's own messages: it also forwards those of FBVINS.
        if message.get_type() == "ODOMETRY" and message.get_srcComponent() == 1 and np.isfinite(message.x):
            self.odometry.append(message)

    def errors(self, begin_s, end_s, align_s=None):
        """Distances of PX4's own positions from the truth, from begin to end, aligned by position and heading at one moment."""
        chosen = [(self.seconds(m.time_usec), np.array([m.x, m.y, m.z]), m.q) for m in self.odometry
                  if begin_s <= self.seconds(m.time_usec) <= end_s]
        if not chosen:
            return np.array([np.inf])
        truths = [self.recording.truth(self.recording.imu_ns[0] + int(s * 1e9)) for s, _, _ in chosen]
        first = min(range(len(chosen)), key=lambda i: abs(chosen[i][0] - (begin_s if align_s is None else align_s)))
        E = rotation(np.array(chosen[first][2])) @ truths[first][1].T
        R = about_z(np.arctan2(E[1, 0] - E[0, 1], E[0, 0] + E[1, 1]))
        return np.array([np.linalg.norm((p - chosen[first][1]) - R @ (truth - truths[first][0]))
                         for (_, p, _), (truth, _) in zip(chosen, truths)])

    def to_sent(self, begin_s, end_s):
        """Distances of PX4's own positions from the positions that it was sent, in one coordinate frame."""
        sent_us, sent = [m.time_usec for m in self.sent], np.array([[m.x, m.y, m.z] for m in self.sent])
        return np.array([np.linalg.norm([m.x, m.y, m.z] - np.array([np.interp(m.time_usec, sent_us, sent[:, axis]) for axis in range(3)]))
                         for m in self.odometry if begin_s <= self.seconds(m.time_usec) <= end_s])

    def told(self):
        return [text for text in self.said if text.startswith("VIO")]

    def flags(self, command):
        """What `listener` printed: name -> value, as text."""
        return dict(re.findall(r"(\w+): (\S+)", self.answers.get(command, "")))


FLAGS = "listener estimator_status_flags -n 1"
AIDS = ("cs_ev_pos", "cs_ev_vel", "cs_ev_yaw", "cs_ev_hgt")


class Report:
    def __init__(self):
        self.failures = 0

    def fact(self, what, true):
        self.failures += not true
        print(f"{'ok   ' if true else 'FAILS'} {what}", flush=True)

    def error(self, what, errors):
        rms, worst = np.sqrt(np.mean(np.square(errors))), np.max(errors)
        self.fact(f"{what}: {100 * rms:.1f} cm RMS, {100 * worst:.1f} cm at most, of {len(errors)} poses", worst <= BAR_M and len(errors) > 50)


def fly(program, recording, trajectory, deliver, ask_at, options=(), parameters=None):
    with tempfile.TemporaryDirectory() as folder:
        with contextlib.closing(Companion(program, options)) as companion, \
                contextlib.closing(Px4(os.environ["FBVINS_PX4"], folder, parameters)) as px4:
            flight = Flight(px4, companion, recording, trajectory, deliver)
            flight.ask_at = dict(ask_at)
            flight.run()
        flight.answers = {command: process.communicate()[0] for command, process in flight.answers.items()}
    return flight


def plain(report, *world):
    flight = fly(*world, lambda pose, s: pose, {12: FLAGS, 0: "listener timesync_status -n 1"})
    report.fact("PX4 fuses position, height, velocity and yaw", all(flight.flags(FLAGS).get(aid) == "True" for aid in AIDS))
    offset_us = int(flight.flags("listener timesync_status -n 1").get("estimated_offset", 10**9))
    report.fact(f"our stamps are on PX4's clock: it sees them off by {offset_us} us", abs(offset_us) < STEP_US)
    report.fact(f"PX4 is told the health: {flight.told()}", flight.told() == ["VIO initialising: waiting_for_motion_or_rest", "VIO good"])
    report.error("flight, to truth", flight.errors(2, 16.8))


def reset(report, *world):
    turn, shift = about_z(np.radians(70)), np.array([1.0, -0.5, 0.2])

    def new_world(pose, s):
        if 9 <= s < 10:
            pose["state"] = "lost"
        elif s >= 10:
            half = np.radians(35)
            q, w, z = pose["q"], np.cos(half), np.sin(half)
            pose.update(p=turn @ pose["p"] + shift, v=turn @ pose["v"], resets=1,
                        q=np.array([w * q[0] - z * q[3], w * q[1] - z * q[2], w * q[2] + z * q[1], w * q[3] + z * q[0]]))
        return pose

    flight = fly(*world, new_world, {})
    report.error("before the restart, to truth", flight.errors(2, 9))
    report.error("after it, to truth", flight.errors(11, 16.8))
    report.error("after it, to the odometry of the new frame", flight.to_sent(11, 16.8))


def outage(report, *world):
    during, after = FLAGS, FLAGS + " "

    def gone(pose, s):
        if 7 <= s < 8.5:
            pose["state"] = "lost"
        return None if 8.5 <= s < 10 else pose

    flight = fly(*world, gone, {9.5: during, 13: after})
    report.error("before the outage, to truth", flight.errors(2, 7))
    report.fact("during it PX4 says that it has no vision", all(flight.flags(during).get(aid) == "False" for aid in AIDS))
    report.fact("and goes on by its IMU alone", flight.flags(during).get("cs_inertial_dead_reckoning") == "True")
    report.fact("after it PX4 fuses again", all(flight.flags(after).get(aid) == "True" for aid in AIDS))
    report.error("after it, to truth, aligned before it", flight.errors(11, 16.8, align_s=2))


def vision_messages(report, *world):
    """VISION_POSITION_ESTIMATE and VISION_SPEED_ESTIMATE. PX4 understands them, except for the velocity; they have no field for quality."""
    flight = fly(*world, lambda pose, s: pose, {12: FLAGS}, ["live.mavlink.dialect=vision_estimate"], {"EKF2_EV_QMIN": 0})
    report.fact("PX4 fuses position, height and yaw of vision messages",
                all(flight.flags(FLAGS).get(aid) == "True" for aid in ("cs_ev_pos", "cs_ev_yaw", "cs_ev_hgt")))
    report.error("flight by vision messages, to truth, from the eighth second", flight.errors(8, 16.8))


def main():
    if "FBVINS_PX4" not in os.environ:
        print("SKIPPED: FBVINS_PX4 does not name a PX4 (bin/px4 of a px4_sitl build), see docs/px4.md")
        return 77
    repository = pathlib.Path(__file__).resolve().parents[2]
    folder = pathlib.Path(os.environ.get("FBVINS_DATA") or repository.parent / "shared" / "data") / "MH_01_easy_17s"
    if not folder.exists():
        print(f"SKIPPED: {folder} is not there; set FBVINS_DATA")
        return 77
    report = Report()
    with tempfile.TemporaryDirectory() as out:
        subprocess.run([sys.argv[1], "run", str(folder), "--quiet", "--out", out], check=True)
        recording = Recording(folder)
        trajectory = Trajectory(pathlib.Path(out) / "trajectory.csv", recording)
    for scenario in (plain, reset, outage, vision_messages):
        scenario(report, sys.argv[2], recording, trajectory)
    return 1 if report.failures else 0


if __name__ == "__main__":
    sys.exit(main())
