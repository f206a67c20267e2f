#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The booster gives the same bits with NEON dot products as on this machine: it is compiled for aarch64 and run by qemu-user.

usage: neon_equality.py SOURCE CXX      exit 77 (skipped) without the cross-compiler and the emulator
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile

FILES = ["booster_network", "booster_kernels", "booster_weights", "safetensors", "int8_gemm", "int8_kernels"]


def build(compiler, source, out):
    sources = [str(source / "src/fbvins/features" / f"{name}.cpp") for name in FILES] + [str(source / "tests/neon/booster_bits.cpp")]
    command = [compiler, "-std=c++20", "-O2", "-ffp-contract=off", "-DFMT_HEADER_ONLY", f"-I{source}/src", f"-I{source}/include", "-I/usr/include/eigen3",
               *sources, "-o", out]
    if compiler.startswith("aarch64"):
        # fmt and Eigen are headers only and know no processor
        links = pathlib.Path(out).parent / "include"
        links.mkdir(exist_ok=True)
        (links / "fmt").symlink_to("/usr/include/fmt")
        command += ["-static", f"-I{links}"]
    subprocess.run(command, check=True)


def main(source, native):
    cross = next((c for c in ("aarch64-linux-gnu-g++", "aarch64-linux-gnu-g++-12") if shutil.which(c)), None)
    emulator = next((e for e in ("qemu-aarch64", "qemu-aarch64-static") if shutil.which(e)), None)
    if not cross or not emulator or not pathlib.Path("/usr/include/fmt").exists():
        print("skipped: needs g++-12-aarch64-linux-gnu, qemu-user and the headers of fmt")
        return 77
    source = pathlib.Path(source).resolve()
    weights = str(source / "data/boost-s.safetensors")
    with tempfile.TemporaryDirectory() as folder:
        build(cross, source, f"{folder}/neon")
        build(native, source, f"{folder}/native")
        ran = subprocess.run([emulator, "-cpu", "max", f"{folder}/neon", weights], check=True, capture_output=True, text=True)
        here = subprocess.run([f"{folder}/native", weights], check=True, capture_output=True, text=True)
    print(ran.stderr + here.stderr, end="")
    assert "NEON dot product" in ran.stderr, "the emulated processor has no dot product"
    assert len(set((ran.stdout + here.stdout).split())) == 1, "the bits differ"
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
