# SPDX-License-Identifier: Apache-2.0
"""The losses (paper eq. 9-11), on Hamming distances of bits with a straight-through gradient.

distance (B, N, M) in bits, positive and usable (B, N, M) masks: which pairs show the same point, which are used at all
(pairs a little farther apart than the tolerance of a match are not).
"""
import torch


def hamming(bits_a, bits_b):
    return 0.5 * (bits_a.shape[-1] - bits_a @ bits_b.transpose(1, 2))


def average_precision(distance, positive, usable, bins=24, largest=256.0):
    """FastAP (eq. 9): the area under precision and recall over a histogram of distances, per row. NaN without positives."""
    step = largest / bins
    at = (distance / step).clamp(0, bins)
    low = at.detach().floor().clamp(max=bins - 1).long()
    share = at - low  # of the upper bin; triangular kernel
    def histogram(weight):
        h = torch.zeros(*distance.shape[:-1], bins + 1, dtype=distance.dtype)
        h = h.scatter_add(-1, low, (1 - share) * weight)
        return h.scatter_add(-1, low + 1, share * weight)
    h_pos = histogram((positive & usable).to(distance.dtype))
    h_all = histogram(usable.to(distance.dtype))
    c_pos, c_all = h_pos.cumsum(-1), h_all.cumsum(-1)
    count = h_pos.sum(-1)
    ap = (h_pos * c_pos / c_all.clamp(min=1e-6)).sum(-1) / count.clamp(min=1e-6)
    return torch.where(count > 0.5, ap, torch.full_like(ap, float("nan")))


def fast_ap_and_boost(distance, raw_distance, positive, usable, rows=96):
    """(1 - AP), and how far AP falls below that of the raw descriptors (eq. 10): mean of max(0, AP_raw / AP - 1)."""
    pick = torch.randperm(distance.shape[1])[:rows]
    positive, usable = positive[:, pick], usable[:, pick]
    ap = average_precision(distance[:, pick], positive, usable)
    with torch.no_grad():
        ap_raw = average_precision(raw_distance[:, pick], positive, usable)
    there = ~torch.isnan(ap)
    ap, ap_raw = ap[there], ap_raw[there]
    return (1 - ap).mean(), (ap_raw / ap.clamp(min=0.02) - 1).clamp(min=0).mean()


class _Contrastive(torch.autograd.Function):
    """With a hand-written gradient, because a training step spends most of its time on the (B, N, M) tensors."""

    @staticmethod
    def forward(ctx, product, positive, usable, bits, bits_per_unit):
        share = torch.exp((product.float() - bits) * (0.5 / bits_per_unit)).masked_fill_(~usable, 0)
        where = (positive & usable).nonzero(as_tuple=True)
        hit = share[where]
        loss, slope = 0.0, torch.zeros_like(hit)
        scales = []
        for dim, at in ((2, (where[0], where[1])), (1, (where[0], where[2]))):
            total = share.sum(dim)
            hits = torch.zeros_like(total).index_put_(at, hit, accumulate=True)
            there = hits > 0
            count = there.sum().clamp(min=1)
            loss = loss + (torch.log(total[there]) - torch.log(hits[there])).sum() / count
            scales.append((there / total.clamp(min=1e-37) / count).unsqueeze(dim))
            slope += 1 / (hits[at].clamp(min=1e-37) * count)
        gradient = share * (scales[0] + scales[1])
        gradient[where] -= hit * slope
        ctx.save_for_backward(gradient.mul_(0.25 / bits_per_unit).to(product.dtype))
        return 0.5 * loss

    @staticmethod
    def backward(ctx, upstream):
        return ctx.saved_tensors[0] * upstream.to(ctx.saved_tensors[0].dtype), None, None, None, None


def contrastive(product, positive, usable, bits, bits_per_unit):
    """InfoNCE with several positives, in both directions: minus log of the softmax's share on positives.

    product (B, N, M) of bits as +-1, from which the distance is (bits - product) / 2."""
    return _Contrastive.apply(product, positive, usable, bits, bits_per_unit)
