"""A small dataset into a training loop: how far away is the strongest point, from the range-Doppler map alone?

With PyTorch installed the batches come from its DataLoader; without, the same loop reads the dataset itself.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

import catseye

arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("recipe", type=Path, help="as scenes/recipes/tiny.toml")
arguments.add_argument("--device", default="auto")
arguments = arguments.parse_args()


def features(sample):
    """Range profile (largest over Doppler, dB) and range of the strongest point."""
    name = next(n for n in sample if n.startswith("range_doppler"))
    profile = 10 * np.log10(sample[name].max(axis=0) + 1e-30)
    points = sample["points"]
    strongest = points["range_m"][np.argmax(points["snr_db"])] if len(points) else 0.0
    return {"profile": profile.astype(np.float32), "range_m": np.float32([strongest])}


def batches(dataset, size=4):
    try:
        from torch.utils.data import DataLoader
    except ImportError:
        for first in range(0, len(dataset), size):
            items = [features(s) for s in dataset[first : first + size]]
            yield tuple(np.stack([i[k] for i in items]) for k in ("profile", "range_m"))
    else:
        for batch in DataLoader(dataset.torch(transform=features), batch_size=size, num_workers=2):
            yield batch["profile"].numpy(), batch["range_m"].numpy()


with tempfile.TemporaryDirectory() as folder:
    report = catseye.dataset(arguments.recipe, Path(folder) / "data", engine=arguments.device)
    print(f"{report['frames']} frames in {report['shards']} shards, {report['bytes']} bytes")
    train = catseye.Dataset(Path(folder) / "data", split="train", tables=["points"])
    print(train)
    # Gradient descent on one linear layer, each bin's level taken from the mean.
    weights, bias, losses = None, 0.0, []
    for epoch in range(20):
        total = 0.0
        for profile, range_m in batches(train):
            x = (profile - profile.mean(axis=1, keepdims=True)) / 20
            if weights is None:
                weights = np.zeros((x.shape[1], 1), np.float32)
            error = x @ weights + bias - range_m
            total += float((error**2).sum())
            weights -= 1e-3 * x.T @ error / len(x)
            bias -= 0.1 * float(error.mean())
        losses.append(total / len(train))
    print(f"mean squared error from {losses[0]:.1f} to {losses[-1]:.1f} m^2")
    assert losses[-1] < losses[0]
