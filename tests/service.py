#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks what `fbvins live` reports to a service manager, with a socket instead of systemd's and a recording as sensors.

usage: service.py FBVINS C++COMPILER
"""
import fcntl
import json
import os
import pathlib
import re
import resource
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

PROGRAM, COMPILER = sys.argv[1:3]

# A thread that is there before main() and blocks no signal, as OpenBLAS makes one when it is loaded.
THREAD_BEFORE_MAIN = """
#include <thread>
#include <unistd.h>
namespace { const bool made = (std::thread([] { while (true) pause(); }).detach(), true); }
"""


# A disk that takes six seconds for each file of a map, and a fifth of one for each write that is not small.
SLOW_DISK = """
#include <cstring>
#include <dlfcn.h>
#include <sys/syscall.h>
#include <unistd.h>
#include <cstdio>
#include <cstdlib>
namespace {
bool has(int file, const char* what) {
  char link[64], path[4096] = {};
  std::snprintf(link, sizeof link, "/proc/self/fd/%d", file);
  return readlink(link, path, sizeof path - 1) > 0 && std::strstr(path, what) != nullptr;
}
}
extern "C" int fsync(int file) {
  if (has(file, ".fbm")) sleep(6);
  return static_cast<int>(syscall(SYS_fsync, file));
}
extern "C" ssize_t write(int file, const void* bytes, size_t size) {
  if (size > 4096 && has(file, std::getenv("SLOW_FOLDER"))) usleep(200'000);
  return syscall(SYS_write, file, bytes, size);
}
extern "C" ssize_t pwrite(int file, const void* bytes, size_t size, off_t offset) {
  if (size > 4096 && has(file, std::getenv("SLOW_FOLDER"))) usleep(200'000);
  return syscall(SYS_pwrite64, file, bytes, size, offset);
}
"""


class Service(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scratch = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.scratch.name)
        cls.flight = cls.folder / "flight"
        subprocess.run([PROGRAM, "simulate", "normal", "--seconds", "4", "--seed", "1", "--quiet", "--out", cls.flight], check=True, timeout=300)

    @classmethod
    def tearDownClass(cls):
        cls.scratch.cleanup()

    def start(self, *arguments, speed="", environment=None):
        """Starts the program with a service manager's socket; returns both."""
        manager = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.addCleanup(manager.close)
        address = str(self.folder / f"notify-{time.monotonic_ns()}")
        manager.bind(address)
        manager.settimeout(120)
        program = subprocess.Popen([PROGRAM, "live", "--source", f"replay:{self.flight}{speed}", *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   text=True, env=dict(os.environ, NOTIFY_SOCKET=address, **(environment or {})))
        self.addCleanup(program.kill)
        return program, manager

    def test_ready_alive_stopping(self):
        program, manager = self.start()
        messages = []
        while not messages or "STOPPING=1" not in messages[-1]:
            messages.append(manager.recv(4096).decode())
        out, err = program.communicate(timeout=120)
        self.assertEqual(program.returncode, 0, err)
        self.assertEqual(sum("READY=1\n" in m for m in messages), 1)
        self.assertIn("READY=1\n", messages[0])
        self.assertTrue(all("WATCHDOG=1\n" in m for m in messages[:-1]), messages)
        self.assertTrue(any(m.startswith("STATUS=good") for m in messages), messages)
        self.assertEqual(out, "", "status lines are for terminals; a journal gets changes only")
        self.assertRegex(err, r"(?m)^<6>good$")

    def test_sigterm_ends_it_in_good_order_and_keeps_the_map(self):
        program, manager = self.start("--laps", "100", "--save-map", str(self.folder / "flat.fbm"))
        while "STATUS=good" not in manager.recv(4096).decode():
            pass
        program.send_signal(signal.SIGTERM)
        _, err = program.communicate(timeout=120)
        self.assertEqual(program.returncode, 0, err)
        self.assertTrue((self.folder / "flat.fbm").exists())

    def test_stop_signals_where_a_library_made_a_thread_before_main(self):
        library = self.library("thread", THREAD_BEFORE_MAIN)
        for stop in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
            with self.subTest(stop.name):
                out = self.folder / stop.name
                out.mkdir()
                program, manager = self.start("--laps", "100", "--map", str(out / "flat.fbm"), "--imu-state", str(out / "imu.yaml"), "--out", str(out / "run"),
                                              environment={"LD_PRELOAD": str(library)})
                while "STATUS=good" not in manager.recv(4096).decode():
                    pass
                program.send_signal(stop)
                _, err = program.communicate(timeout=120)
                self.assertEqual(program.returncode, 0, err)
                self.assertTrue((out / "flat.fbm").exists() and (out / "imu.yaml").exists() and (out / "run" / "trajectory.csv").exists())
                self.assertEqual(list(out.rglob("*.part")), [])

    def library(self, name, text):
        """Compiled, to be loaded before the program."""
        source, library = self.folder / f"{name}.cpp", self.folder / f"{name}.so"
        source.write_text(text, encoding="utf-8")
        subprocess.run([COMPILER, "-shared", "-fPIC", "-pthread", source, "-o", library], check=True, timeout=120)
        return library

    def test_a_slow_disk_holds_up_no_pose(self):
        folder = self.folder / "slow_disk"
        folder.mkdir()
        program, manager = self.start("--map", str(folder / "flat.fbm"), "--out", str(folder / "run"), "--record", str(folder / "flight.mcap"),
                                      "--record-keep-free", "0", "--laps", "11", speed="@2",
                                      environment={"LD_PRELOAD": str(self.library("slow_disk", SLOW_DISK)), "SLOW_FOLDER": str(folder)})
        while program.poll() is None and "STOPPING=1" not in manager.recv(4096).decode():
            pass
        _, err = program.communicate(timeout=120)
        self.assertEqual(program.returncode, 0, err)
        live = json.loads((folder / "run" / "summary.json").read_text(encoding="utf-8"))["live"]
        # Waiting for a map's file would cost twelve seconds of the recording, 240 images; for the record or the results as many. A
        # busy machine may cost half of that.
        self.assertLess(live["images_dropped"], 120)
        self.assertLess(live["shutter_to_pose_ms"]["max"], 6000)
        self.assertGreater(sum(self.sessions_of(folder / "flat.fbm").values()), 5)

    def test_what_stands_in_the_way_of_an_output_does_not_stop_the_poses(self):
        folder = self.folder / "in_the_way"
        folder.mkdir()
        (folder / "flight.mcap").write_text("the flight before", encoding="utf-8")
        (folder / "flat.fbm").write_text("rubbish", encoding="utf-8")
        (folder / "imu.yaml").write_text("", encoding="utf-8")
        program, _ = self.start("--record", str(folder / "flight.mcap"), "--record-keep-free", "0", "--map", str(folder / "flat.fbm"),
                                "--imu-state", str(folder / "imu.yaml"), "--reset-counter", str(folder / "counter"))
        _, err = program.communicate(timeout=120)
        self.assertEqual(program.returncode, 0, err)
        self.assertEqual((folder / "flight.mcap").read_text(encoding="utf-8"), "the flight before")
        self.assertGreater((folder / "flight-2.mcap").stat().st_size, 1_000_000)
        self.assertEqual((folder / "flat.fbm.bad").read_text(encoding="utf-8"), "rubbish")
        self.assertGreater(sum(self.sessions_of(folder / "flat.fbm").values()), 5)
        self.assertTrue((folder / "imu.yaml.bad").exists() and (folder / "imu.yaml").stat().st_size > 100)
        self.assertEqual((folder / "counter").read_text(encoding="utf-8"), "0\n")

    def test_every_file_is_tried_when_another_cannot_be_written(self):
        folder = self.folder / "every_file"
        folder.mkdir()
        program, manager = self.start("--record", str(folder / "unplugged" / "flight.mcap"), "--map", str(folder / "flat.fbm"),
                                      "--imu-state", str(folder / "none" / "imu.yaml"), "--out", str(folder / "run"))
        messages = manager.recv(4096).decode()
        _, err = program.communicate(timeout=120)
        self.assertEqual(program.returncode, 2, "what went wrong is the result")
        self.assertIn("unplugged", messages, "and in the status during the flight")
        self.assertTrue((folder / "flat.fbm").exists() and (folder / "run" / "summary.json").exists(), err)

    def fly_to_its_end(self, name, **streams):
        """A flight of its own streams, with all files; returns their folder and the exit code."""
        folder = self.folder / name
        folder.mkdir()
        done = subprocess.run([PROGRAM, "live", "--source", f"replay:{self.flight}", "--record", folder / "flight.mcap", "--map", folder / "flat.fbm",
                               "--imu-state", folder / "imu.yaml", "--out", folder / "run"], timeout=120, check=False, **streams)
        for file in ("flat.fbm", "imu.yaml", "run/summary.json", "run/trajectory_tum.txt"):
            self.assertTrue((folder / file).exists(), file)
        return folder, done.returncode

    def test_no_file_gets_the_number_of_a_closed_stream(self):
        def close():
            for number in (0, 1, 2):
                os.close(number)

        folder, code = self.fly_to_its_end("closed", preexec_fn=close)
        self.assertEqual(code, 0)
        self.assertEqual((folder / "flight.mcap").read_bytes()[:5], b"\x89MCAP")
        for file in ("run/trajectory_tum.txt", "run/trajectory.csv"):
            self.assertNotIn("{", (folder / file).read_text(), file)

    def test_full_streams_cost_no_file(self):
        with open("/dev/full", "w", encoding="utf-8") as full:
            _, code = self.fly_to_its_end("full", stdout=full, stderr=full)
        self.assertEqual(code, 2, "the status could not be written")

    def test_a_pipe_that_nobody_reads_holds_up_nothing(self):
        unread, pipe = os.pipe()
        fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, 4096)
        _, code = self.fly_to_its_end("unread", stdout=pipe, stderr=pipe)
        self.assertEqual(code, 0)
        os.close(unread), os.close(pipe)

    def test_a_record_at_the_largest_size_of_a_file_costs_no_other(self):
        _, code = self.fly_to_its_end("largest", preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (4 << 20, 4 << 20)), stdout=subprocess.DEVNULL,
                                     stderr=subprocess.DEVNULL)
        self.assertEqual(code, 2, "what went wrong is the result")

    def test_a_kept_map_outlives_a_killed_program(self):
        kept = self.folder / "kept.fbm"
        arguments = ("--map", str(kept), "--laps", "1000")
        program, manager = self.start(*arguments, speed="@20")
        while not pathlib.Path(f"{kept}.journal").exists():
            manager.recv(4096)
        program.kill()
        program.communicate(timeout=120)
        sessions = self.sessions_of(kept)
        self.assertGreater(sum(sessions.values()), 5)
        program, manager = self.start(*arguments[:2], speed="@1")
        _, err = program.communicate(timeout=120)
        self.assertEqual(program.returncode, 0, err)
        # Whether the second flight finds itself in it depends on what the first one dropped: its laps do not join.
        self.assertNotIn("begins a new map", err)
        self.assertEqual([p.name for p in self.folder.glob("kept.fbm*")], ["kept.fbm"], "nothing was set aside, and the journal is part of the file")
        self.assertLessEqual(sessions.items(), self.sessions_of(kept).items(), "the second flight keeps what the first one has mapped")

    def sessions_of(self, path):
        """The keyframes that each session of a map has flown."""
        done = subprocess.run([PROGRAM, "map", "info", path], capture_output=True, text=True, timeout=120, check=True)
        return {int(number): int(flown) for number, flown in re.findall(r"session (\d+): .* (\d+) keyframes,", done.stdout)}

    def test_a_manager_that_is_not_there(self):
        done = subprocess.run([PROGRAM, "live", "--source", f"replay:{self.flight}"], capture_output=True, text=True, timeout=120, check=False,
                              env=dict(os.environ, NOTIFY_SOCKET=str(self.folder / "none")))
        self.assertEqual(done.returncode, 2)
        self.assertIn("NOTIFY_SOCKET=", done.stderr)
        self.assertIn("images 80, with a pose", done.stderr, "it flies nevertheless")


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]])
