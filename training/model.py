# SPDX-License-Identifier: Apache-2.0
"""The booster's network (paper 2.2.2, eq. 6-8): from descriptors and keypoint geometry to better bits.

One architecture, two sizes. `src/fbvins/features/booster_network.hpp` is the same in C++; docs/derivations/booster.md
explains it. Input of one image: margins (N, 512), of which the first 256 have the signs of the bits, geometry (N, 7) from
`geometry_of`; output: (N, 256) numbers whose signs are the new bits.
"""
import dataclasses
import math

import torch
from torch import nn

GEOMETRY = 7  # x, y, score in the image, mean score, cos, sin of the angle, log of the scale


@dataclasses.dataclass
class Size:
    """Dimensions of a network; stored in the weights file."""
    width: int
    descriptor_hidden: int
    keypoint_hidden: tuple
    layers: int
    residual: bool  # a linear path from the input to the output
    margins: bool  # the input is the margins of the bits and of the surroundings, rather than +-1
    bits: int = 256

    @property
    def inputs(self):
        return 2 * self.bits if self.margins else self.bits


SIZES = {
    "boost-b": Size(256, 512, (32, 64, 128), 4, residual=True, margins=True),
    "boost-s": Size(128, 320, (32, 64), 1, residual=True, margins=True),
}


def geometry_of(keypoints, width, height, valid):
    """(B, N, 6) keypoints x, y, level, scale, angle, score of images of (B,) width and height to (B, N, GEOMETRY)."""
    x, y, _, scale, angle, score = keypoints.unbind(-1)
    half = 0.5 * torch.maximum(width, height)[:, None]
    log_score = torch.log1p(score.clamp(min=0))
    count = valid.sum(1, keepdim=True).clamp(min=1)
    mean = (log_score * valid).sum(1, keepdim=True) / count
    return torch.stack([(x - 0.5 * width[:, None]) / half, (y - 0.5 * height[:, None]) / half, (log_score - mean) * 0.5,
                        (mean * 0.1).expand_as(x), torch.cos(angle), torch.sin(angle), torch.log(scale.clamp(min=1)) * 2], -1)


class AttentionFree(nn.Module):
    """One summary of all keypoints, gated for each keypoint by its own query (eq. 7-8)."""

    def __init__(self, width):
        super().__init__()
        self.query, self.key, self.value, self.out = (nn.Linear(width, width) for _ in range(4))

    def forward(self, z, valid):
        key = self.key(z).float().masked_fill(~valid[..., None], -math.inf)
        summary = (torch.softmax(key, 1) * self.value(z).float()).sum(1, keepdim=True)
        return self.out(torch.sigmoid(self.query(z).float()) * summary)


class Layer(nn.Module):
    def __init__(self, width):
        super().__init__()
        self.attention = AttentionFree(width)
        self.norm1, self.norm2 = nn.LayerNorm(width), nn.LayerNorm(width)
        self.up, self.down = nn.Linear(width, 2 * width), nn.Linear(2 * width, width)

    def forward(self, z, valid, cross):
        if cross:
            z = self.norm1(z + self.attention(z, valid).float())
        else:
            z = self.norm1(z)
        return self.norm2(z + self.down(torch.relu(self.up(z))).float())


class Booster(nn.Module):
    """`geometry`, `cross` and `around` switch off the geometry path, cross-boosting and the margins of the surroundings, for
    ablation only: the C++ network always has all of them."""

    def __init__(self, size, geometry=True, cross=True, around=True):
        super().__init__()
        self.size, self.geometry, self.cross, self.around = size, geometry, cross, around
        self.descriptor1 = nn.Linear(size.inputs, size.descriptor_hidden)
        self.descriptor2 = nn.Linear(size.descriptor_hidden, size.width)
        widths = [GEOMETRY, *size.keypoint_hidden, size.width]
        self.keypoint = nn.ModuleList(nn.Linear(a, b) for a, b in zip(widths, widths[1:]))
        self.layers = nn.ModuleList(Layer(size.width) for _ in range(size.layers))
        self.head = nn.Linear(size.width, size.bits)
        if size.residual:
            self.skip = nn.Linear(size.inputs, size.bits, bias=False)
            with torch.no_grad():
                self.skip.weight.copy_(torch.eye(size.bits, size.inputs))

    def forward(self, margins, geometry, valid):
        bits = self.size.bits
        x = margins if self.size.margins else torch.where(margins[..., :bits] > 0, 1.0, -1.0)
        if not self.around:
            x = torch.cat([x[..., :bits], torch.zeros_like(x[..., bits:])], -1)
        z = self.descriptor2(torch.relu(self.descriptor1(x)))
        if self.geometry:
            g = geometry
            for i, linear in enumerate(self.keypoint):
                g = linear(g if i == 0 else torch.relu(g))
            z = z + g
        z = z.float()
        for layer in self.layers:
            z = layer(z, valid, self.cross)
        y = self.head(z).float()
        return y + self.skip(x).float() if self.size.residual else y


def hard_bits(y):
    """+-1 in the forward pass, the gradient of tanh in the backward pass (straight-through estimator)."""
    soft = torch.tanh(y)
    return soft + (torch.where(y > 0, 1.0, -1.0) - soft).detach()
