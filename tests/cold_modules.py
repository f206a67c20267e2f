#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Modules that are compiled with little optimisation (COLD, cmake/FbvinsModule.cmake) have no products and decompositions of Eigen in
common with those that fly: the linker takes either copy for the whole program.

usage: cold_modules.py NM LIBRARY... -- LIBRARY...      the cold ones first
"""
import re
import subprocess
import sys

# A quaternion that turns one vector, and one of a matrix: a few multiplications, which no module does in its inner loops.
HARMLESS = re.compile(r"_ZNK5Eigen14QuaternionBase\w+_transformVector|_ZN5Eigen8internal26quaternionbase_assign_impl")
OF_EIGEN = re.compile(r" [WV] (_ZNK?5Eigen\w+)$", re.M)


def shared_functions(nm, libraries):
    """Functions of Eigen that any other library may have as well."""
    listed = subprocess.run([nm, *libraries], check=True, capture_output=True, text=True).stdout
    return {name for name in OF_EIGEN.findall(listed) if not HARMLESS.match(name)}


def main():
    nm, middle = sys.argv[1], sys.argv.index("--")
    cold, others = sys.argv[2:middle], sys.argv[middle + 1:]
    twice = sorted(shared_functions(nm, cold) & shared_functions(nm, others))
    for name in twice:
        print(f"compiled in a cold module and in another one: {name}")
    print(f"{len(cold)} cold modules, {len(others)} others: {len(twice)} functions of Eigen in common")
    return 1 if twice or len(cold) < 2 or len(others) < 2 else 0


if __name__ == "__main__":
    sys.exit(main())
