#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A few steps of training on a few synthetic pictures: the loss falls, the same seed gives the same weights, the weights
file is read back unchanged, an interrupted run continues as if it had not been interrupted. Pairs of a simulated room have true correspondences.
train_test.py BOOSTER_PAIRS. Skipped (77) where PyTorch is not installed."""
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
try:
    import numpy as np
    import torch
except ImportError as missing:
    print(f"skipped: {missing.name} is not installed (apt-get install python3-torch, or pip install torch numpy)")
    sys.exit(77)
from dataset import Batch, open_pairs  # noqa: E402
from losses import hamming  # noqa: E402
import train as trainer  # noqa: E402
from train import arguments_of, train  # noqa: E402
from weights import FORMAT, load_model, load_weights  # noqa: E402


def rooms_are_true(program, folder):
    path = f"{folder}/rooms.bin"
    subprocess.run([program, "--rooms", "1", "--pairs", "6", "--seed", "3", "--out", path], check=True)
    batch = Batch(open_pairs(path)[:])
    distance = hamming(batch.a.bits, batch.b.bits)
    same, other = distance[batch.apart() < 1.5].median(), distance[(batch.apart() > 30) & batch.both].median()
    print(f"simulated room: the same points are {same:.0f} bits apart, others {other:.0f}")
    assert same < 0.6 * other, "points are not where the geometry says"


def interrupt_at_step(step, run):
    losses_of, calls = trainer.losses_of, [0]

    def interrupted(*arguments):
        calls[0] += 1
        if calls[0] > step:
            raise KeyboardInterrupt
        return losses_of(*arguments)

    trainer.losses_of = interrupted
    try:
        run()
    except KeyboardInterrupt:
        pass
    else:
        raise AssertionError("the run was not interrupted")
    finally:
        trainer.losses_of = losses_of


def main(program):
    torch.set_num_threads(1)
    with tempfile.TemporaryDirectory() as folder:
        rooms_are_true(program, folder)
        pairs = f"{folder}/pairs.bin"
        subprocess.run([program, "--leaves", "2", "--pairs", "2", "--seed", "4", "--out", pairs], check=True)

        def weights_of(out, *more):
            losses = train(arguments_of(["--pairs", pairs, "--out", out, "--steps", "16", "--batch", "4", "--seed", "3", "--rate", "2e-3", *more]))
            print("loss:", " ".join(f"{x:.3f}" for x in losses))
            return losses, pathlib.Path(out, "boost-s.safetensors").read_bytes()

        losses, first = weights_of(f"{folder}/a")
        assert np.mean(losses[-4:]) < 0.95 * np.mean(losses[:4]), "the loss does not fall"
        assert weights_of(f"{folder}/b")[1] == first, "the same seed gives other weights"
        interrupt_at_step(12, lambda: weights_of(f"{folder}/c", "--evaluate-every", "8"))
        assert weights_of(f"{folder}/c", "--resume")[1] == first, "a run that was interrupted gives other weights"
        meta, arrays = load_weights(f"{folder}/a/boost-s.safetensors")
        assert meta["format"] == FORMAT and meta["steps"] == "16"
        for name, tensor in load_model(f"{folder}/a/boost-s.safetensors").state_dict().items():
            assert np.array_equal(tensor.numpy(), arrays[name]), name


if __name__ == "__main__":
    main(sys.argv[1])
