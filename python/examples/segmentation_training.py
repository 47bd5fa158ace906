"""Range-Doppler segmentation in PyTorch: which cells of the map does each class of object fill?

The map and its mask are computed of a dataset's samples when a frame is read, so that the dataset holds neither. A small network of convolutions
learns the mask from the map in decibels. The weights are written as a state dictionary beside the figures of every epoch.

    python segmentation_training.py recipe.toml radar.toml --classes car marker --epochs 20 -o model.pt
"""

import argparse
import json
import tempfile
from pathlib import Path

import numpy as np
import torch
from torch import nn
from torch.utils.data import DataLoader

import catseye

arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
arguments.add_argument("recipe", type=Path, help="a recipe with adc and truth kept, as scenes/recipes/tiny.toml")
arguments.add_argument("radar", type=Path, help="the radar that the recipe names")
arguments.add_argument("--data", type=Path, help="folder of the dataset, made where it is not there; default a temporary one")
arguments.add_argument("--classes", nargs="+", required=True, help="classes of the mask, as in the table of boxes")
arguments.add_argument("--device", default="cpu", help="of catseye")
arguments.add_argument("--epochs", type=int, default=20)
arguments.add_argument("--batch", type=int, default=4)
arguments.add_argument("--workers", type=int, default=0)
arguments.add_argument("--seed", type=int, default=1)
arguments.add_argument("-o", "--output", type=Path, default=Path("segmentation.pt"))


class Segmenter(nn.Module):
    """Convolutions over [doppler, range] that keep its size: scores [class, doppler, range], class 0 for no object.

    The Doppler axis closes on itself, the range axis ends, and the network pads them so.
    """

    def __init__(self, classes: int, width: int = 16) -> None:
        super().__init__()
        sizes = [1, width, 2 * width, width]
        self.layers = nn.ModuleList(nn.Conv2d(a, b, 3) for a, b in zip(sizes, sizes[1:]))
        self.norms = nn.ModuleList(nn.GroupNorm(4, b) for b in sizes[1:])
        self.last = nn.Conv2d(width, classes, 1)

    def forward(self, maps: torch.Tensor) -> torch.Tensor:
        for layer, norm in zip(self.layers, self.norms):
            around = nn.functional.pad(maps, (0, 0, 1, 1), mode="circular")
            maps = torch.relu(norm(layer(nn.functional.pad(around, (1, 1, 0, 0)))))
        return self.last(maps)


def features(sample):
    """The map in decibels over its median, [1, doppler, range], and the class of each cell."""
    power = sample["range_doppler"].astype(np.float64) + 1e-30
    level = 10 * np.log10(power / np.median(power))
    return {
        "map": torch.from_numpy((level[None] / 20).astype(np.float32)),
        "mask": torch.from_numpy(sample["mask_range_doppler"].astype(np.int64)),
    }


def loader(folder, split, options, shuffle):
    tensors = {"range_doppler": {}, "masks": {"classes": options.classes}}
    dataset = catseye.Dataset(
        folder, split=split, arrays=[], tables=[], tensors=tensors, radar=options.radar, engine=options.device
    )
    return DataLoader(
        dataset.torch(transform=features), batch_size=options.batch, shuffle=shuffle, num_workers=options.workers
    )


def evaluate(model, batches, classes):
    """Intersection over union of each class over all cells of all frames; NaN for a class that is neither there nor found."""
    both, either = np.zeros(classes), np.zeros(classes)
    model.eval()
    with torch.no_grad():
        for batch in batches:
            found, truth = model(batch["map"]).argmax(dim=1), batch["mask"]
            for k in range(classes):
                both[k] += int(((found == k) & (truth == k)).sum())
                either[k] += int(((found == k) | (truth == k)).sum())
    return np.divide(both, either, out=np.full(classes, np.nan), where=either > 0)


def train(folder, options):
    torch.manual_seed(options.seed)
    classes = len(options.classes) + 1
    batches = loader(folder, "train", options, shuffle=True)
    validation = loader(folder, "validation", options, shuffle=False)
    # Cells without an object are by far the most: classes weigh as the root of how seldom they are.
    counts = np.zeros(classes)
    for batch in batches:
        counts += np.bincount(batch["mask"].numpy().ravel(), minlength=classes)
    missing = [name for name, count in zip(options.classes, counts[1:]) if count == 0]
    if missing:
        raise SystemExit(f"no cell of the training set holds {', '.join(missing)}: see the column class of its table of boxes")
    weights = torch.tensor(np.sqrt(counts.sum() / np.maximum(counts, 1)), dtype=torch.float32)
    model = Segmenter(classes)
    optimiser = torch.optim.Adam(model.parameters(), lr=3e-3)
    loss_of = nn.CrossEntropyLoss(weight=weights)
    history = []
    for epoch in range(options.epochs):
        model.train()
        total = 0.0
        for batch in batches:
            optimiser.zero_grad()
            loss = loss_of(model(batch["map"]), batch["mask"])
            loss.backward()
            optimiser.step()
            total += loss.item() * len(batch["map"])
        shares = evaluate(model, validation, classes)
        history.append({"epoch": epoch, "loss": total / len(batches.dataset), "iou": shares.tolist()})
        words = ", ".join(f"{n} {s:.3f}" for n, s in zip(["nothing", *options.classes], shares))
        print(f"epoch {epoch}: loss {history[-1]['loss']:.4f}, intersection over union {words}")
    return model, history


def main():
    options = arguments.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.data or Path(temporary) / "data"
        catseye.dataset(options.recipe, folder, engine=options.device)
        model, history = train(folder, options)
    torch.save({"state": model.state_dict(), "classes": options.classes}, options.output)
    options.output.with_suffix(".json").write_text(json.dumps(history, indent=1))
    print(f"wrote {options.output}")
    if len(history) > 1 and not history[-1]["loss"] < history[0]["loss"]:
        raise SystemExit("the network learnt nothing: the loss did not fall")


if __name__ == "__main__":
    main()
