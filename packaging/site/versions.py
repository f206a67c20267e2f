#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The list of the versions that a site has, for its choice of a version, and a first page that leads to the newest release.

usage: versions.py SITE      SITE: a folder with one folder for each version; `next` is that of the working tree
"""
import json
import pathlib
import sys


def order(version):
    """Releases from the newest on, and what is not released yet at the end."""
    numbers = version.split(".")
    return (1, []) if not all(n.isdigit() for n in numbers) else (0, [-int(n) for n in numbers])


def main():
    site = pathlib.Path(sys.argv[1])
    versions = sorted((f.name for f in site.iterdir() if (f / "index.html").exists()), key=order)
    if not versions:
        sys.exit(f"{site}: there is no version in it")
    listed = [{"version": v, "title": f"{v} (not released)" if v == "next" else v, "aliases": []} for v in versions]
    (site / "versions.json").write_text(json.dumps(listed, indent=1) + "\n", encoding="utf-8")
    first = f"{versions[0]}/index.html"
    (site / "index.html").write_text(f'<!doctype html>\n<meta charset="utf-8">\n<title>FB-VINS</title>\n<meta http-equiv="refresh" content="0; url={first}">\n'
                                     f'<a href="{first}">FB-VINS {versions[0]}</a>\n', encoding="utf-8")


if __name__ == "__main__":
    main()
