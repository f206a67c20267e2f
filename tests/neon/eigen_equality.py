#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Eigen and the mathematical library give the same bits on arm64 as on this machine. eigen_bits.cpp is compiled for both with
the flags of the build, and the arm64 program is run by qemu-user. The test also checks that the bits differ without the header
that makes Eigen round alike: otherwise it would prove nothing.

usage: eigen_equality.py SOURCE CXX [SYSROOT]    skipped (77) without the cross-compiler, the emulator and SIMDe (libsimde-dev)
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile

OPTIONS = ["-std=c++20", "-O2", "-ffp-contract=off", "-fno-builtin"]


def includes(folder, sysroot):
    """Eigen and SIMDe are headers only: of the sysroot, or this machine's."""
    root = pathlib.Path(sysroot or "/")
    if sysroot:
        return [f"--sysroot={root}", f"-isystem{root}/usr/include/eigen3"]
    links = pathlib.Path(folder) / "include"
    links.mkdir(exist_ok=True)
    (links / "simde").symlink_to(root / "usr/include/simde")
    return ["-static", "-isystem/usr/include/eigen3", f"-isystem{links}"]


def sums(command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()


def has_fma():
    return "fma" in pathlib.Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace").split()


def main(source, native, sysroot=None):
    cross = next((c for c in ("aarch64-linux-gnu-g++", "aarch64-linux-gnu-g++-12") if shutil.which(c)), None)
    emulator = next((e for e in ("qemu-aarch64", "qemu-aarch64-static") if shutil.which(e)), None)
    if not cross or not emulator or not pathlib.Path(sysroot or "/", "usr/include/simde").exists():
        print("skipped: needs g++-12-aarch64-linux-gnu, qemu-user and libsimde-dev")
        return 77
    source = pathlib.Path(source).resolve()
    bits, header = source / "tests/neon/eigen_bits.cpp", source / "src/fbvins/core/eigen_as_on_x86_64.hpp"
    with tempfile.TemporaryDirectory() as folder:
        OPTIONS.append(f"-I{source / 'src'}")
        subprocess.run([native, *OPTIONS, "-isystem/usr/include/eigen3", bits, "-o", f"{folder}/native"], check=True)
        arm = [cross, *OPTIONS, *includes(folder, sysroot), bits, "-o"]
        subprocess.run([*arm, f"{folder}/arm", "-include", header], check=True)
        subprocess.run([*arm, f"{folder}/neon"], check=True)
        emulate = [emulator, *(["-L", sysroot] if sysroot else [])]
        here, there, neon = sums([f"{folder}/native"]), sums([*emulate, f"{folder}/arm"]), sums([*emulate, f"{folder}/neon"])
    different = [a for a, b in zip(here, there) if a != b]
    if not has_fma():  # without it a thousandth of the functions' results are rounded otherwise (docs/service.md)
        different = [line for line in different if not line.startswith("functions")]
    print(f"{len(here)} hashes; different on arm64: {different or 'none'}; with Eigen's own NEON code: {sum(a != b for a, b in zip(here, neon))}")
    assert len(here) == len(there) and not different
    assert here != neon, "Eigen's own NEON code gives the same bits: is the header still needed?"
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
