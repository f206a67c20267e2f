#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Freely licensed pictures for training: photographs and textures of Debian's packages, cut into grey views.

  training/free_pictures.py --out out/pictures                downloads the packages with apt-get, unpacks, cuts
  training/free_pictures.py --out out/pictures --debs DIR     packages downloaded before

Everything in Debian's main archive may be used, changed and passed on for any purpose; each package names its pictures'
authors and licences in usr/share/doc/PACKAGE/copyright (training/README.md has a list). The same packages give the same
bytes. Needs python3-pil.
"""
import argparse
import io
import pathlib
import subprocess
import tempfile
import zipfile

import numpy as np
from PIL import Image

Image.MAX_IMAGE_PIXELS = None

# Of each package: where its pictures are. Drawings, symbols and screenshots are left out, by folder or by MIN_CORNERS.
PACKAGES = {
    "supertuxkart-data": ["usr/share/games/supertuxkart/data/textures", "usr/share/games/supertuxkart/data/tracks",
                          "usr/share/games/supertuxkart/data/library"],
    "nexuiz-textures": ["usr/share/games/nexuiz/data"],
    "stellarium-data": ["usr/share/stellarium/landscapes"],
    "visp-images-data": ["usr/share/visp-images-data/ViSP-images/Klimt", "usr/share/visp-images-data/ViSP-images/Solvay",
                         "usr/share/visp-images-data/ViSP-images/mbt-cao"],
    "lomiri-wallpapers-16.04": ["usr/share/backgrounds"],
    "lomiri-wallpapers-20.04": ["usr/share/backgrounds"],
    "mate-backgrounds": ["usr/share/backgrounds/mate/nature"],
    "plasma-workspace-wallpapers": ["usr/share/wallpapers"],
    "python3-skimage": ["usr/lib/python3/dist-packages/skimage/data"],
    "python3-sklearn": ["usr/lib/python3/dist-packages/sklearn/datasets/images"],
}
SUFFIXES = {".jpg", ".jpeg", ".png", ".tga", ".ppm", ".pgm"}
VIEW = (480, 352)          # largest width and height of a view, px
SCALES = (1.0, 0.5, 0.25)  # of a picture
VIEWS_PER_SCALE = 6
MOST_VIEWS = 600           # of a package
MIN_SIDE = 256             # px; smaller pictures and scales are left out
MIN_CORNERS = 0.02         # share of pixels with a clear second gradient: less is a sky or a drawing


def pictures_of(root, folders):
    """Paths and contents of the pictures below the folders, those in .pk3 archives too, in order."""
    for folder in folders:
        for path in sorted((root / folder).rglob("*")):
            if path.suffix.lower() in SUFFIXES:
                yield path.name, path.read_bytes()
            elif path.suffix == ".pk3":
                with zipfile.ZipFile(path) as archive:
                    for name in sorted(archive.namelist()):
                        if pathlib.Path(name).suffix.lower() in SUFFIXES:
                            yield pathlib.Path(name).name, archive.read(name)


def gray_of(content):
    """Grey picture, or None if the content is no picture, too small or mostly transparent."""
    try:
        picture = Image.open(io.BytesIO(content))
        if min(picture.size) < MIN_SIDE:
            return None
        if picture.mode in ("RGBA", "LA", "PA") and np.asarray(picture.convert("RGBA"))[..., 3].mean() < 250:
            return None
        return picture.convert("RGB").convert("L")
    except (OSError, SyntaxError, ValueError):
        return None


def has_corners(view):
    """Whether enough of the pixels differ from their surroundings in both directions."""
    v = np.asarray(view, dtype=np.float32)
    dx, dy = np.abs(v[1:-1, 2:] - v[1:-1, :-2]), np.abs(v[2:, 1:-1] - v[:-2, 1:-1])
    return (np.minimum(dx, dy) > 12).mean() > MIN_CORNERS


def views_of(picture, rng):
    for scale in SCALES:
        size = (round(picture.width * scale), round(picture.height * scale))
        if min(size) < MIN_SIDE:
            return
        scaled = picture.resize(size, Image.LANCZOS) if scale < 1 else picture
        width, height = (min(a, b) for a, b in zip(size, VIEW))
        room = (size[0] - width, size[1] - height)
        for _ in range(VIEWS_PER_SCALE if sum(room) > 64 else 1):
            x, y = int(rng.integers(room[0] + 1)), int(rng.integers(room[1] + 1))
            view = scaled.crop((x, y, x + width, y + height))
            if has_corners(view):
                yield view


def unpack(package, debs, folder):
    found = sorted(debs.glob(f"{package}_*.deb"))
    if not found:
        raise SystemExit(f"{debs}: no package {package}")
    subprocess.run(["dpkg", "-x", str(found[-1]), str(folder)], check=True)


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--out", required=True, type=pathlib.Path, help="folder for the views: one folder per package, PNG")
    p.add_argument("--debs", type=pathlib.Path, help="folder of packages that were downloaded before")
    a = p.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        debs = a.debs or pathlib.Path(scratch) / "debs"
        if a.debs is None:
            debs.mkdir()
            subprocess.run(["apt-get", "download", *PACKAGES], cwd=debs, check=True)
        for package, folders in PACKAGES.items():
            root, out = pathlib.Path(scratch) / package, a.out / package
            out.mkdir(parents=True, exist_ok=True)
            unpack(package, debs, root)
            rng, views, seen = np.random.default_rng(1), [], set()
            for name, content in pictures_of(root, folders):
                if hash(content) in seen:
                    continue
                seen.add(hash(content))
                picture = gray_of(content)
                views += [(name, view) for view in views_of(picture, rng)] if picture else []
            chosen = sorted(rng.permutation(len(views))[:MOST_VIEWS])
            for i in chosen:
                name, view = views[i]
                view.save(out / f"{i:05d}_{pathlib.Path(name).stem[:40]}.png")
            print(f"{package}: {len(chosen)} views", flush=True)


if __name__ == "__main__":
    main()
