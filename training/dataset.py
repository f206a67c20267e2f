# SPDX-License-Identifier: Apache-2.0
"""Reads what `booster_pairs` writes: records of fixed size, mapped into memory."""
import numpy as np
import torch

MOST = 500
VIEW = np.dtype([("count", "<i4"), ("width", "<i4"), ("height", "<i4"), ("keypoints", "<f4", (MOST, 6)),
                 ("descriptors", "u1", (MOST, 32))])
PAIR = np.dtype([("picture", "<i4"), ("condition", "<i4"), ("a_in_b", "<f4", (MOST, 2)), ("a", VIEW), ("b", VIEW)])
CONDITIONS = ["small motion", "viewpoint", "light change", "low light and blur", "all at once"]


def open_pairs(path):
    return np.memmap(path, PAIR, mode="r")


class Views:
    """A batch of views as tensors: bits (B, N, 256) as +-1, keypoints (B, N, 6), valid (B, N)."""

    def __init__(self, records):
        bits = np.unpackbits(records["descriptors"], axis=-1, bitorder="little").astype(np.float32)
        self.bits = torch.from_numpy(2 * bits - 1)
        self.keypoints = torch.from_numpy(np.ascontiguousarray(records["keypoints"]))
        self.width = torch.from_numpy(records["width"].astype(np.float32))
        self.height = torch.from_numpy(records["height"].astype(np.float32))
        self.valid = torch.arange(MOST)[None] < torch.from_numpy(records["count"].astype(np.int64))[:, None]


class Batch:
    """Pairs of views and where each keypoint of a is in b: `apart` (B, N, N) in px."""

    def __init__(self, records):
        self.a, self.b = Views(records["a"]), Views(records["b"])
        self.condition = torch.from_numpy(records["condition"].astype(np.int64))
        in_b = torch.from_numpy(np.nan_to_num(records["a_in_b"], nan=-1e6))  # not to be seen: nowhere near
        self.apart = torch.cdist(in_b, self.b.keypoints[..., :2], compute_mode="donot_use_mm_for_euclid_dist")
        both = self.a.valid[:, :, None] & self.b.valid[:, None, :]
        self.apart = torch.where(both, self.apart, torch.full_like(self.apart, 1e6))
        self.both = both
