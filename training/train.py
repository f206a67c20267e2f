#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Trains the booster: pictures in, weights out.

  training/train.py --images PHOTOS --out out/boost-s                  pairs made first, by build/training/booster_pairs
  training/train.py --pairs pairs.bin --held-out held.bin --out out/boost-s --minutes 60
  training/train.py --resume --out out/boost-s --minutes 30             continues an interrupted run

Writes checkpoint.pt, curve.csv, curve.png (where matplotlib is installed) and the weights as .safetensors. Same seed,
same data, one thread: the same weights. A GPU is used where there is one.
"""
import argparse
import collections
import concurrent.futures
import csv
import itertools
import math
import pathlib
import subprocess
import sys
import time

import numpy as np
import torch

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from dataset import CONDITIONS, Batch, open_pairs  # noqa: E402
from evaluation import evaluate, gains  # noqa: E402
from losses import contrastive, fast_ap_and_boost, hamming  # noqa: E402
from model import SIZES, Booster, geometry_of, hard_bits  # noqa: E402
from weights import load_model, round_weights, save_weights  # noqa: E402

FEWEST_KEYPOINTS = 20  # of a view used in training
REPOSITORY = pathlib.Path(__file__).resolve().parents[1]


def arguments_of(argv):
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--images", nargs="*", default=[], help="folders of photographs")
    p.add_argument("--pairs", nargs="*", default=[], help="files of booster_pairs instead of --images")
    p.add_argument("--held-out", help="file of booster_pairs, of held-out pictures")
    p.add_argument("--out", required=True, help="folder for checkpoints, curves and weights")
    p.add_argument("--size", choices=list(SIZES), default="boost-s")
    p.add_argument("--steps", type=int, default=20000, help="length of the schedule")
    p.add_argument("--minutes", type=float, default=math.inf, help="the schedule ends after this time at the latest")
    p.add_argument("--batch", type=int, default=12, help="pairs per step")
    p.add_argument("--share", type=float, nargs=len(CONDITIONS), default=[1, 1, 1, 1, 1],
                   help="relative sampling weight of pairs of each condition")
    p.add_argument("--keypoints", type=int, default=320, help="most keypoints of a view")
    p.add_argument("--rate", type=float, default=1e-3, help="largest learning rate")
    p.add_argument("--ap", type=float, default=0.0, help="weight of FastAP (eq. 9)")
    p.add_argument("--boost", type=float, default=0.0, help="lambda of the boost loss (eq. 11), relative to --ap")
    p.add_argument("--contrastive", type=float, default=1.0, help="weight of the contrastive term")
    p.add_argument("--temperature", type=float, default=4.0, help="bits per unit of the contrastive logit")
    p.add_argument("--no-geometry", action="store_true", help="without the geometry path")
    p.add_argument("--no-cross", action="store_true", help="without cross-boosting")
    p.add_argument("--no-residual", action="store_true", help="without the linear path from input to output")
    p.add_argument("--no-margins", action="store_true", help="bits instead of margins as input")
    p.add_argument("--no-around", action="store_true", help="without the margins of the surroundings")
    p.add_argument("--head-scale", type=float, default=0.1, help="scale of the last layer's random initialisation")
    p.add_argument("--tolerance", type=float, default=3.0, help="largest distance of a correct match, px")
    p.add_argument("--start", help="checkpoint or weights (.safetensors) to start from")
    p.add_argument("--ahead", type=int, default=0, help="steps whose pairs are prepared ahead, on as many threads: for a GPU")
    p.add_argument("--seed", type=int, default=1)
    p.add_argument("--resume", action="store_true")
    p.add_argument("--evaluate-every", type=int, default=500)
    p.add_argument("--evaluate-pairs", type=int, default=100)
    p.add_argument("--program", default=str(REPOSITORY / "build" / "training" / "booster_pairs"))
    p.add_argument("--pairs-per-image", type=int, default=20)
    return p.parse_args(argv)


def make_pairs(a, out):
    """The last fifth of every folder is held out."""
    for part, count in (("train", a.pairs_per_image), ("held-out", 5)):
        subprocess.run([a.program, "--images", *a.images, "--part", part, "--pairs", str(count), "--seed", str(a.seed), "--out",
                        str(out / f"{part}.bin")], check=True)
    return [str(out / "train.bin")], str(out / "held-out.bin")


def as_if_moved(v, generator):
    """Augmentation: keypoints as if the camera had been turned, rolled and moved closer. Steered bits do not change.

    Without this the network relies on a point's position in the image, which is similar in the two views of a training
    pair but not in two views of a flight.
    """
    def uniform(low, high):
        return low + (high - low) * torch.rand(len(v.width), 1, generator=generator)
    turn, zoom = uniform(-0.8, 0.8), torch.exp(uniform(-0.4, 0.4))
    cos, sin = zoom * torch.cos(turn), zoom * torch.sin(turn)
    x, y, level, scale, angle, score = v.keypoints.unbind(-1)
    w, h = v.width[:, None], v.height[:, None]
    x, y = x - 0.5 * w, y - 0.5 * h
    x, y = cos * x - sin * y + (0.5 + uniform(-0.6, 0.6)) * w, sin * x + cos * y + (0.5 + uniform(-0.6, 0.6)) * w
    return torch.stack([x, y, level, scale, angle + turn, score], -1)


def in_a_window(v, generator):
    """Mask of the keypoints in a random window of each view. Two views of a flight overlap only partly; with the same
    keypoints in both, the network would come to rely on equal summaries."""
    keep = v.valid
    for axis, length in ((0, v.width), (1, v.height)):
        share = 0.5 + 0.5 * torch.rand(len(length), 1, generator=generator)
        start = (1 - share) * torch.rand(len(length), 1, generator=generator)
        at = v.keypoints[..., axis] / length[:, None]
        keep = keep & (at >= start) & (at <= start + share)
    return torch.where(keep.sum(1, keepdim=True) < 20, v.valid, keep)  # too few in the window: the whole view


def thin_out(v, most, generator):
    """Keeps at most `most` random keypoints of a window, which also saves computation. Returns their indices."""
    v.valid = in_a_window(v, generator)
    chance = torch.rand(v.valid.shape, generator=generator) + v.valid
    index = chance.topk(min(most, chance.shape[1]), dim=1).indices
    v.keep(index)
    return index


class Prepared:
    """The batch of a step: random pairs, keypoints and positions. A generator per step: the same whether resumed or not, prepared
    ahead or not."""

    def __init__(self, files, where, chance, a, step):
        pick = np.random.default_rng((a.seed, step)).choice(len(where), a.batch, replace=False, p=chance)
        generator = torch.Generator().manual_seed(a.seed * 1000003 + step)
        self.batch = Batch(np.stack([files[f][i] for f, i in where[pick]]))
        index = thin_out(self.batch.a, a.keypoints, generator)
        self.batch.in_b = self.batch.in_b.collect(1, index[..., None].expand(-1, -1, 2))
        thin_out(self.batch.b, a.keypoints, generator)
        self.geometry = [geometry_of(as_if_moved(v, generator), v.width, v.height, v.valid) for v in (self.batch.a, self.batch.b)]


def prepared_steps(prepare, first, ahead):
    """Prepares steps in order, `ahead` of them on threads of their own."""
    if ahead == 0:
        yield from map(prepare, itertools.count(first))
    with concurrent.futures.ThreadPoolExecutor(ahead) as pool:
        waiting = collections.deque(pool.submit(prepare, first + i) for i in range(2 * ahead))
        try:
            for step in itertools.count(first + 2 * ahead):
                yield waiting.popleft().result()
                waiting.append(pool.submit(prepare, step))
        finally:
            pool.shutdown(cancel_futures=True)


def losses_of(model, prepared, a, device):
    batch, y = prepared.batch, []
    for v, geometry in zip((batch.a, batch.b), prepared.geometry):
        with torch.autocast(device.type, torch.bfloat16, enabled=a.autocast):
            y.append(model(v.margins.to(device), geometry.to(device), v.valid.to(device)))
    # integers up to 256 are exact in bfloat16
    half = torch.bfloat16 if a.autocast else torch.float32
    product = hard_bits(y[0].float()).to(half) @ hard_bits(y[1].float()).to(half).transpose(1, 2)
    apart = batch.apart().to(device)
    positive = apart < a.tolerance
    usable = batch.both.to(device) & (positive | (apart > 1.7 * a.tolerance))
    out = {}
    if a.contrastive > 0:
        out["contrastive"] = contrastive(product, positive, usable, y[0].shape[-1], a.temperature)
    if a.ap > 0:
        raw = hamming(batch.a.bits.to(device), batch.b.bits.to(device))
        out["ap"], out["boost"] = fast_ap_and_boost(0.5 * (y[0].shape[-1] - product.float()), raw, positive, usable)
    total = a.contrastive * out.get("contrastive", 0) + a.ap * (out.get("ap", 0) + a.boost * out.get("boost", 0))
    return total, {k: float(v) for k, v in out.items()}


def plot(out):
    try:
        import matplotlib
        matplotlib.use("Agg")
        import matplotlib.pyplot as plt
    except ImportError:
        return
    rows = list(csv.DictReader(open(out / "curve.csv")))
    if not rows:
        return
    figure, axes = plt.subplots(1, 2, figsize=(11, 4))
    steps = [int(r["step"]) for r in rows]
    axes[0].plot(steps, [float(r["loss"]) for r in rows])
    axes[0].set(xlabel="step", ylabel="training loss")
    for name in CONDITIONS:
        points = [(s, float(r[name])) for s, r in zip(steps, rows) if r[name] != ""]
        axes[1].plot(*zip(*points), label=name) if points else None
    axes[1].set(xlabel="step", ylabel="correct matches, held out, against raw [%]")
    if axes[1].lines:
        axes[1].legend()
    axes[1].axhline(0, color="grey", lw=0.5)
    figure.tight_layout()
    figure.savefig(out / "curve.png", dpi=110)


class Schedule:
    """Warm-up, then half a cosine down to a hundredth. Progress is counted in steps or in time, whichever is further."""

    def __init__(self, a, spent_s):
        self.a, self.start = a, time.time() - spent_s

    def progress(self, step):
        return min(1.0, max(step / self.a.steps, self.spent_s() / (60 * self.a.minutes)))

    def spent_s(self):
        return time.time() - self.start

    def rate(self, step):
        warm = min(1.0, (step + 1) / min(100, 0.1 * self.a.steps))
        return self.a.rate * warm * (0.01 + 0.99 * 0.5 * (1 + math.cos(math.pi * self.progress(step))))


def initial_weights(path, device):
    if path.endswith(".safetensors"):
        return load_model(path).state_dict()
    return torch.load(path, map_location=device)["averaged"]


def train(a):
    out = pathlib.Path(a.out)
    out.mkdir(parents=True, exist_ok=True)
    torch.manual_seed(a.seed)
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    a.autocast = True
    pairs, held = (a.pairs, a.held_out) if a.pairs else make_pairs(a, out)
    files = [open_pairs(p) for p in pairs]
    held = open_pairs(held)[:a.evaluate_pairs] if held else None
    where = np.concatenate([[(f, i) for i in range(len(m))] for f, m in enumerate(files)])
    # views with few keypoints are not used: without any there is no summary
    seen = np.concatenate([np.minimum(m["a"]["count"], m["b"]["count"]) >= FEWEST_KEYPOINTS for m in files])
    chance = np.concatenate([np.asarray(a.share, float)[m["condition"]] for m in files]) * seen
    chance /= chance.sum()

    size = SIZES[a.size]
    if a.no_residual:
        size.residual = False
    if a.no_margins:
        size.margins = False
    model = Booster(size, not a.no_geometry, not a.no_cross, not a.no_around).to(device)
    with torch.no_grad():
        model.head.weight *= a.head_scale
        model.head.bias *= a.head_scale
    if a.start:
        model.load_state_dict(initial_weights(a.start, device))
    optimiser = torch.optim.AdamW(model.parameters(), lr=a.rate, weight_decay=1e-3, betas=(0.9, 0.98))
    step, spent_s, averaged = 0, 0.0, None
    if a.resume and (out / "checkpoint.pt").exists():
        saved = torch.load(out / "checkpoint.pt", map_location=device)
        model.load_state_dict(saved["model"])
        optimiser.load_state_dict(saved["optimiser"])
        step, spent_s, averaged = saved["step"], saved["spent_s"], saved["averaged"]
    elif (out / "curve.csv").exists():
        (out / "curve.csv").unlink()
    print(f"{a.size}: {sum(p.numel() for p in model.parameters())} parameters, {len(where)} pairs, {device}", flush=True)
    averaged = averaged or {k: v.clone() for k, v in model.state_dict().items()}
    schedule, recent, terms = Schedule(a, spent_s), [], {}
    fresh = not (out / "curve.csv").exists()
    curve = open(out / "curve.csv", "a", newline="")
    writer = csv.writer(curve)
    if fresh:
        writer.writerow(["step", "minutes", "rate", "loss", *CONDITIONS])

    def checkpoint(final=False):
        torch.save({"model": model.state_dict(), "optimiser": optimiser.state_dict(), "step": step,
                    "spent_s": schedule.spent_s(), "averaged": averaged, "arguments": vars(a)}, out / "checkpoint.tmp")
        (out / "checkpoint.tmp").rename(out / "checkpoint.pt")
        best = Booster(size, model.geometry, model.cross, model.around)
        best.load_state_dict(averaged if final or step > 300 else model.state_dict())
        round_weights(best)
        save_weights(out / f"{a.size}.safetensors", best, {"name": a.size, "steps": step, "minutes": round(schedule.spent_s() / 60)})
        scores = [""] * len(CONDITIONS)
        if held is not None:
            best.eval()
            g = gains(evaluate(best, held))
            scores = [f"{g[c]:.2f}" for c in CONDITIONS]
        writer.writerow([step, f"{schedule.spent_s() / 60:.2f}", f"{schedule.rate(step):.2e}", f"{np.mean(recent[-200:] or [0]):.4f}", *scores])
        curve.flush()
        plot(out)
        left = schedule.spent_s() * (1 / max(schedule.progress(step), 1e-6) - 1) / 60
        print(f"step {step}  {schedule.spent_s() / 60:.1f} min, {left:.1f} left  loss {np.mean(recent[-200:] or [0]):.4f}  "
              + " ".join(f"{k} {v:.3f}" for k, v in terms.items()) + "  held out: " + " ".join(f"{s}%" for s in scores), flush=True)

    for prepared in prepared_steps(lambda number: Prepared(files, where, chance, a, number), step, a.ahead):
        if schedule.progress(step) >= 1.0:
            break
        for group in optimiser.param_groups:
            group["lr"] = schedule.rate(step)
        loss, terms = losses_of(model, prepared, a, device)
        if not torch.isfinite(loss):
            sys.exit(f"the loss of step {step} is {float(loss)}: lower --rate or check the pairs")
        optimiser.zero_grad()
        loss.backward()
        if not torch.isfinite(torch.nn.utils.clip_grad_norm_(model.parameters(), 1.0)):
            sys.exit(f"the gradient of step {step} is not finite: lower --rate or check the pairs")
        optimiser.step()
        recent.append(float(loss))
        step += 1
        keep = min(0.998, step / (step + 20))
        with torch.no_grad():
            for k, v in model.state_dict().items():
                averaged[k].mul_(keep).add_(v, alpha=1 - keep)
        if step % a.evaluate_every == 0:
            checkpoint()
    checkpoint(final=True)
    return recent


if __name__ == "__main__":
    torch.set_num_threads(1)
    train(arguments_of(sys.argv[1:]))
