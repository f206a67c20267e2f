#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`fbvins live` with a map, all of its outputs and injected faults: it ends well, whatever fails, and each output has got something. The same runs
are done under sanitizers: `./dev test` (address, undefined), `./dev check threads`.

usage: live_faults.py FBVINS-LIVE FLIGHT [--speed S] [--only NAME]     FLIGHT: a recording of 13 s (tests/simulated_flight.py)
"""
import argparse
import base64
import json
import os
import pathlib
import re
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

# name, frontend, arguments; times in seconds of the flight, which moves from 3 s on
SCENARIOS = [
    ("cameras and IMU off, then both", "klt", ["--fault", "camera_off:4:0.8", "--fault", "imu_off:6:0.5", "--fault", "unplugged:8:0.5"]),
    ("cameras off for 11 s", "klt", ["--laps", "2", "--fault", "camera_off:4:11"]),
    ("one camera off, one frozen, images lost", "boost", ["--fault", "left_off:4:1.5", "--fault", "right_frozen:7:1.5", "--fault", "lose_images:9:4:0.3"]),
    ("a clock that jumps, and bursts", "orb", ["--fault", "leap:4:2:1", "--fault", "burst:8:4:0.2"]),
    ("a clock that is set back", "klt", ["--fault", "leap:6:100:-0.3"]),
    ("a device that begins again", "klt", ["--fault", "unplugged:6:1.5", "--fault", "leap:7:100:-100000"]),
]
COUNTS = {"a clock that jumps, and bursts": {"clock_leaps": 4, "clock_set_back": 0}, "a clock that is set back": {"clock_leaps": 2, "clock_set_back": 1, "resets": 1},
          "a device that begins again": {"clock_leaps": 2, "clock_set_back": 1, "resets": 1}}
MCAP_MAGIC = b"\x89MCAP0\r\n"
STARTED_S, ENDED_S = 60, 400


class FlightController:
    """Another end of a MAVLink connection: heartbeats, and answers to TIMESYNC with a clock of its own. Counts what it is sent."""

    AHEAD_NS = 5_000_000_000_000
    EXTRA = {0: 50, 111: 34}

    def __init__(self):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(0.1)
        self.port, self.peer, self.poses, self.sent, self.done = self.socket.getsockname()[1], None, 0, 0, False
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def close(self):
        self.done = True
        self.thread.join()
        self.socket.close()

    def send(self, number, payload):
        body = struct.pack("<BBBBBB", len(payload), 0, 0, self.sent % 256, 1, 1) + number.to_bytes(3, "little") + payload
        crc = 0xFFFF
        for byte in body + bytes([self.EXTRA[number]]):
            low = (byte ^ crc) & 0xFF
            low ^= (low << 4) & 0xFF
            crc = (crc >> 8) ^ (low << 8) ^ (low << 3) ^ (low >> 4)
        self.sent += 1
        self.socket.sendto(b"\xfd" + body + struct.pack("<H", crc), self.peer)

    def run(self):
        next_beat = 0.0
        while not self.done:
            try:
                data, self.peer = self.socket.recvfrom(4096)
                self.take(data)
            except OSError:
                pass
            if self.peer and time.monotonic() >= next_beat:
                next_beat = time.monotonic() + 1
                self.send(0, struct.pack("<IBBBBB", 0, 2, 12, 0, 4, 3))

    def take(self, data):
        number = int.from_bytes(data[7:10], "little")
        self.poses += number == 331  # ODOMETRY
        if number == 111:
            tc1, ts1 = struct.unpack("<qq", data[10:10 + data[1]].ljust(16, b"\0")[:16])
            if tc1 == 0:
                self.send(111, struct.pack("<qq", time.monotonic_ns() + self.AHEAD_NS, ts1))


class Visitor:
    """Reads the page's stream; counts bytes."""

    def __init__(self, address):
        self.bytes = 0
        host, port, token = re.match(r"http://([^:/]+):(\d+)/(?:[#?](.*))?", address).groups()
        self.socket = socket.create_connection((host, int(port)), timeout=5)
        key = base64.b64encode(os.urandom(16)).decode()
        target = "/stream" + (f"?{token}" if token else "")
        self.socket.sendall(f"GET {target} HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n".encode())
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        try:
            while data := self.socket.recv(1 << 16):
                self.bytes += len(data)
        except OSError:
            pass

    def close(self):
        self.socket.close()
        self.thread.join()


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def supports(program, option):
    return option in subprocess.run([program, "live", "--help"], capture_output=True, text=True, check=True).stdout


def address_of_page(program, said):
    """Lines that the program writes go to `said`; returns when the page has an address, or the program has none."""
    address = []
    ready = threading.Event()

    def read():
        for line in program.stderr:
            said.append(line)
            if found := re.search(r"the page is (\S+)", line):
                address.append(found[1])
                ready.set()
        ready.set()

    reader = threading.Thread(target=read)
    reader.start()
    ready.wait(STARTED_S)
    return (address or [None])[0], reader


def fly(arguments, folder, frontend, more):
    controller, said, visitor = FlightController(), [], None
    command = [arguments.program, "live", "--source", f"replay:{arguments.flight}@{arguments.speed}", "--frontend", frontend, "--quiet",
               "--out", folder / "out", "--loop", "--save-map", folder / "map.fbm", "--imu-state", folder / "imu.json",
               "--record", folder / "flight.mcap", "--mavlink", f"udp:127.0.0.1:{controller.port}", *more]
    if supports(arguments.program, "--ros2"):
        command += ["--ros2", str(100 + os.getpid() % 100)]
    command += ["--web", str(free_port())]
    program = subprocess.Popen([str(part) for part in command], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    try:
        page, reader = address_of_page(program, said)
        if page:
            visitor = Visitor(page)
        code = program.wait(timeout=ENDED_S)
        reader.join()
    finally:
        program.kill()
        program.wait()
        controller.close()
        if visitor:
            visitor.close()
    return code, "".join(said), controller, visitor


def faults_of(name, folder, code, said, controller, visitor):
    """What is wrong with the flight's end and its outputs."""
    if code != 0:
        return [f"exit code {code}"]
    wrong = []
    summary = json.loads((folder / "out" / "summary.json").read_text(encoding="utf-8"))
    if not summary["live"]["images"]:
        wrong.append("no image was estimated")
    wrong += [f"{count} is {summary['live'][count]}, not {wanted}" for count, wanted in COUNTS.get(name, {}).items() if summary["live"][count] != wanted]
    record = (folder / "flight.mcap").read_bytes()
    if not (record.startswith(MCAP_MAGIC) and record.endswith(MCAP_MAGIC)):
        wrong.append("the record was not finished")
    for name in ("map.fbm", "imu.json", "out/live_tum.txt"):
        if not (folder / name).exists() or not (folder / name).stat().st_size:
            wrong.append(f"{name} is empty")
    if left := [p.name for p in folder.rglob("*.part")]:
        wrong.append(f"unfinished: {left}")
    if not controller.poses:
        wrong.append("the flight controller got no pose")
    if visitor and visitor.bytes < 1000:
        wrong.append("the page's visitor got nothing")
    if "Sanitizer" in said or "runtime error" in said:
        wrong.append("a sanitizer's report")
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("flight", type=pathlib.Path)
    parser.add_argument("--speed", type=float, default=1, help="slower where sanitizers need more time")
    parser.add_argument("--only", help="scenarios whose name contains this")
    arguments = parser.parse_args()
    failed = 0
    for name, frontend, more in SCENARIOS:
        if arguments.only and arguments.only not in name:
            continue
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            begin = time.monotonic()
            code, said, controller, visitor = fly(arguments, folder, frontend, more)
            wrong = faults_of(name, folder, code, said, controller, visitor)
        print(f"{frontend}, {name}: {'; '.join(wrong) or 'fine'} ({time.monotonic() - begin:.0f} s, {controller.poses} poses to the flight controller)",
              flush=True)
        if wrong:
            print(said, file=sys.stderr)
        failed += bool(wrong)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
