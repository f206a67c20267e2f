#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Stores the network's output for one view, for the C++ tests: store_vectors.py WEIGHTS PAIRS OUT [COUNT]."""
import json
import pathlib
import struct
import sys

import numpy as np
import torch

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from dataset import Views, open_pairs  # noqa: E402
from model import geometry_of  # noqa: E402
from weights import load_model  # noqa: E402


def main(weights, pairs, out, count=40):
    model = load_model(weights)
    view = open_pairs(pairs)[:1]["a"].copy()
    view["count"] = min(int(count), int(view["count"][0]))
    n = int(view["count"][0])
    views = Views(view)
    with torch.no_grad():
        y = model(views.margins, geometry_of(views.keypoints, views.width, views.height, views.valid), views.valid)
    tensors = {"keypoints": view["keypoints"][0, :n], "margins": view["margins"][0, :n], "output": y[0, :n].numpy()}
    header, blobs, at = {"__metadata__": {"width": str(view["width"][0]), "height": str(view["height"][0])}}, [], 0
    for name, values in tensors.items():
        half = name == "margins"
        blob = np.ascontiguousarray(values, "<f2" if half else "<f4").tobytes()
        header[name] = {"dtype": "F16" if half else "F32", "shape": list(values.shape), "data_offsets": [at, at + len(blob)]}
        blobs.append(blob)
        at += len(blob)
    text = json.dumps(header).encode()
    pathlib.Path(out).write_bytes(struct.pack("<Q", len(text)) + text + b"".join(blobs))


if __name__ == "__main__":
    main(*sys.argv[1:])
