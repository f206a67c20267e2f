# SPDX-License-Identifier: Apache-2.0
"""Correct mutual nearest neighbours of raw and boosted bits, by condition, as bench/features measures them in C++."""
import numpy as np
import torch

from dataset import CONDITIONS, Batch
from model import geometry_of


def mutual_matches(bits_a, bits_b, both):
    """(B, N) index into b or -1. Ties go to the first, as in the C++ matcher."""
    d = 0.5 * (256 - bits_a @ bits_b.transpose(1, 2))
    d = torch.where(both, d, torch.full_like(d, 1e4))
    n = d.shape[1]
    order = torch.arange(n, dtype=d.dtype) / (4 * n)
    ab = (d + order[None, None, :]).argmin(2)
    ba = (d + order[None, :, None]).argmin(1)
    mutual = ba.collect(1, ab) == torch.arange(n)[None]
    valid = both.any(2)
    return torch.where(mutual & valid, ab, torch.full_like(ab, -1))


def boosted_bits(model, views):
    geometry = geometry_of(views.keypoints, views.width, views.height, views.valid)
    return torch.where(model(views.margins, geometry, views.valid) > 0, 1.0, -1.0)


def count_correct(bits_a, bits_b, batch, tolerance_px=3.0):
    match = mutual_matches(bits_a, bits_b, batch.both)
    apart = batch.apart().collect(2, match.clamp(min=0)[..., None])[..., 0]
    found = match >= 0
    return (found & (apart < tolerance_px)).sum(1), found.sum(1)


@torch.no_grad()
def evaluate(model, records, batch_size=10):
    """{condition: (correct raw, correct boosted, matches raw, matches boosted)}, sums over the records."""
    sums = {name: np.zeros(4) for name in CONDITIONS}
    for start in range(0, len(records), batch_size):
        batch = Batch(records[start:start + batch_size])
        raw = count_correct(batch.a.bits, batch.b.bits, batch)
        new = count_correct(boosted_bits(model, batch.a), boosted_bits(model, batch.b), batch)
        for i, condition in enumerate(batch.condition.tolist()):
            sums[CONDITIONS[condition]] += [raw[0][i], new[0][i], raw[1][i], new[1][i]]
    return sums


def gains(sums):
    """Per cent more correct matches, by condition."""
    return {name: 100.0 * (s[1] / max(s[0], 1) - 1) for name, s in sums.items()}
