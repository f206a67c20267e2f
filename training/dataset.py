# SPDX-License-Identifier: Apache-2.0
"""Reads what `booster_pairs` writes: records of fixed size, mapped into memory."""
import numpy as np
import torch

MOST = 500
MARGIN_UNIT = 1 / 32  # features/keypoint.hpp
VIEW = np.dtype([("count", "<i4"), ("width", "<i4"), ("height", "<i4"), ("keypoints", "<f4", (MOST, 6)),
                 ("margins", "i1", (MOST, 512))])
PAIR = np.dtype([("picture", "<i4"), ("condition", "<i4"), ("a_in_b", "<f4", (MOST, 2)), ("a", VIEW), ("b", VIEW)])
CONDITIONS = ["small motion", "viewpoint", "light change", "low light and blur", "all at once"]


def open_pairs(path):
    return np.memmap(path, PAIR, mode="r")


class Views:
    """A batch of views as tensors: margins (B, N, 512), of the bits and of the surroundings; the signs of the former, the
    bits (B, N, 256), as +-1; keypoints (B, N, 6), valid (B, N)."""

    def __init__(self, records):
        self.margins = torch.from_numpy(records["margins"].astype(np.float32)) * MARGIN_UNIT
        self.bits = torch.where(self.margins[..., :256] > 0, 1.0, -1.0)
        self.keypoints = torch.from_numpy(np.ascontiguousarray(records["keypoints"]))
        self.width = torch.from_numpy(records["width"].astype(np.float32))
        self.height = torch.from_numpy(records["height"].astype(np.float32))
        self.valid = torch.arange(MOST)[None] < torch.from_numpy(records["count"].astype(np.int64))[:, None]

    def keep(self, index):
        """Keeps the keypoints at index (B, K)."""
        def take(x):
            return x.collect(1, index.reshape(*index.shape, *[1] * (x.dim() - 2)).expand(-1, -1, *x.shape[2:]))
        self.margins, self.bits, self.keypoints, self.valid = map(take, (self.margins, self.bits, self.keypoints, self.valid))


class Batch:
    """Pairs of views and where each keypoint of a is in b."""

    def __init__(self, records):
        self.a, self.b = Views(records["a"]), Views(records["b"])
        self.condition = torch.from_numpy(records["condition"].astype(np.int64))
        self.in_b = torch.from_numpy(np.nan_to_num(records["a_in_b"], nan=-1e6))  # not visible: far from every keypoint

    @property
    def both(self):
        """(B, N, M): both keypoints exist."""
        return self.a.valid[:, :, None] & self.b.valid[:, None, :]

    def apart(self):
        """(B, N, M), px: distance from the true position of each keypoint of a in b to each keypoint of b."""
        apart = torch.cdist(self.in_b, self.b.keypoints[..., :2], compute_mode="donot_use_mm_for_euclid_dist")
        return torch.where(self.both, apart, torch.full_like(apart, 1e6))
