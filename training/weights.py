# SPDX-License-Identifier: Apache-2.0
"""Weights as .safetensors, without a library: eight bytes of length, a JSON header, the tensors in half precision (what C++ reads)."""
import dataclasses
import json
import struct

FORMAT = "fbvins-booster-3"


def round_weights(model):
    """Rounds, in place, the weights of every product that is computed with 8-bit integers in C++ (features/int8_gemm.hpp) to
    those integers, so that evaluation and file use the same weights as the C++ network."""
    import torch
    with torch.no_grad():
        for layer in model.modules():
            if isinstance(layer, torch.nn.Linear) and layer.in_features >= 16:
                unit = layer.weight.abs().amax(1, keepdim=True).clamp(min=1e-12) / 127
                layer.weight.copy_(torch.round(layer.weight / unit) * unit)
    return model


def save_weights(path, model, notes):
    meta = {"format": FORMAT, **{k: str(v) for k, v in notes.items()}}
    for field in dataclasses.fields(model.size):
        value = getattr(model.size, field.name)
        meta[field.name] = ",".join(map(str, value)) if isinstance(value, tuple) else str(int(value))
    header, blobs, at = {"__metadata__": meta}, [], 0
    for name, tensor in sorted(model.state_dict().items()):
        blob = tensor.detach().float().cpu().numpy().astype("<f2").tobytes()
        header[name] = {"dtype": "F16", "shape": list(tensor.shape), "data_offsets": [at, at + len(blob)]}
        blobs.append(blob)
        at += len(blob)
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    with open(path, "wb") as file:
        file.write(struct.pack("<Q", len(text)) + text + b"".join(blobs))


def load_weights(path):
    """(metadata, {name: numpy array})."""
    import numpy as np
    data = open(path, "rb").read()
    length = struct.unpack("<Q", data[:8])[0]
    header = json.loads(data[8:8 + length])
    meta = header.pop("__metadata__")
    body = data[8 + length:]
    kinds = {"F16": "<f2", "F32": "<f4"}
    return meta, {n: np.frombuffer(body[e["data_offsets"][0]:e["data_offsets"][1]], kinds[e["dtype"]]).reshape(e["shape"]).astype("<f4")
                  for n, e in header.items()}


def load_model(path):
    """The network with the weights of a file."""
    import torch
    from model import Booster, Size
    meta, arrays = load_weights(path)
    fields = {}
    for field in dataclasses.fields(Size):
        text = meta[field.name]
        fields[field.name] = tuple(map(int, text.split(","))) if field.name == "keypoint_hidden" else int(text)
    for name in ("residual", "margins"):
        fields[name] = bool(fields[name])
    model = Booster(Size(**fields))
    model.load_state_dict({k: torch.from_numpy(v.copy()) for k, v in arrays.items()})
    return model.eval()
