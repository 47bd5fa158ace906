"""Point classification in PyTorch: on which kind of object does each point of a radar lie?

A small PointNet (Qi, Su, Mo and Guibas 2017) looks at the points of one frame: each goes through the same perceptrons, the maximum over the
frame tells what the others are like, and both together give the scores of the classes. Labels are the class of the object that a simulated
point lies on; ghosts and points in side lobes are of none. They never enter the network: features() takes measured columns alone.

    python point_training.py recipe.toml --classes car marker --epochs 30 -o points.pt
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
arguments.add_argument("recipe", type=Path, help="a recipe with points kept, as scenes/recipes/tiny.toml")
arguments.add_argument("--data", type=Path, help="folder of the dataset, made where it is not there; default a temporary one")
arguments.add_argument("--classes", nargs="+", required=True, help="classes of objects, as in the column class of the points")
arguments.add_argument("--device", default="cpu", help="of catseye")
arguments.add_argument("--epochs", type=int, default=30)
arguments.add_argument("--batch", type=int, default=8)
arguments.add_argument("--seed", type=int, default=1)
arguments.add_argument("-o", "--output", type=Path, default=Path("points.pt"))

# Measured columns and by what they are divided.
COLUMNS = {"x_m": 50.0, "y_m": 50.0, "range_rate_mps": 10.0, "snr_db": 40.0, "rcs_dbsm": 20.0}


class PointNet(nn.Module):
    """Scores [frame, point, class] of points [frame, point, feature]. `there` says which rows are points and not filling."""

    def __init__(self, classes: int, width: int = 32) -> None:
        super().__init__()
        perceptron = lambda a, b: nn.Sequential(nn.Linear(a, b), nn.LayerNorm(b), nn.ReLU())
        self.each = nn.Sequential(perceptron(len(COLUMNS), width), perceptron(width, width))
        self.all = perceptron(width, 4 * width)
        self.both = nn.Sequential(perceptron(5 * width, width), nn.Linear(width, classes))

    def forward(self, points: torch.Tensor, there: torch.Tensor) -> torch.Tensor:
        each = self.each(points)
        # After a ReLU nothing is below zero, so that filling never is the largest.
        frame = (self.all(each) * there[..., None]).amax(dim=1, keepdim=True)
        return self.both(torch.cat([each, frame.expand(-1, points.shape[1], -1)], dim=2))


def features(classes):
    """What a sample becomes: the points' measured columns [point, feature], and the class of each, 0 for none of those named."""
    place = {name: k + 1 for k, name in enumerate(classes)}

    def of(sample):
        points = sample["points"]
        columns = [points[name] / unit for name, unit in COLUMNS.items()]
        real = ~(points["ghost"] | points["side_lobe"] | points["folded"] | points["aliased"])
        labels = [place.get(str(name), 0) if there else 0 for name, there in zip(points["class"], real)]
        return torch.tensor(np.stack(columns, axis=1), dtype=torch.float32), torch.tensor(labels, dtype=torch.int64)

    return of


def collate(frames):
    """Frames of unlike numbers of points, filled up to the longest; the label of filling is -1."""
    points = nn.utils.rnn.pad_sequence([f[0] for f in frames], batch_first=True)
    labels = nn.utils.rnn.pad_sequence([f[1] for f in frames], batch_first=True, padding_value=-1)
    return points, labels


def loader(folder, split, options, shuffle):
    dataset = catseye.Dataset(folder, split=split, arrays=[], tables=["points"])
    frames = dataset.torch(transform=features(options.classes))
    return DataLoader(frames, batch_size=options.batch, shuffle=shuffle, collate_fn=collate)


def f1_of(model, batches, classes):
    """F1 of each class over all points; NaN for a class that is neither there nor found."""
    counts = np.zeros((classes, classes))
    model.eval()
    with torch.no_grad():
        for points, labels in batches:
            there = labels >= 0
            if there.any():
                found = model(points, there).argmax(dim=2)[there].numpy()
                np.add.at(counts, (labels[there].numpy(), found), 1)
    either = counts.sum(axis=0) + counts.sum(axis=1)
    return np.divide(2 * np.diag(counts), either, out=np.full(classes, np.nan), where=either > 0)


def train(folder, options):
    torch.manual_seed(options.seed)
    names = ["others", *options.classes]
    batches = loader(folder, "train", options, shuffle=True)
    validation = loader(folder, "validation", options, shuffle=False)
    counts = np.zeros(len(names))
    for _, labels in batches:
        counts += np.bincount(labels[labels >= 0].numpy(), minlength=len(names))
    missing = [name for name, count in zip(names[1:], counts[1:]) if count == 0]
    if missing:
        raise SystemExit(f"no point of the training set lies on {', '.join(missing)}: see the column class of its table of points")
    weights = torch.tensor(np.sqrt(counts.sum() / np.maximum(counts, 1)), dtype=torch.float32)
    model = PointNet(len(names))
    optimiser = torch.optim.Adam(model.parameters(), lr=3e-3)
    loss_of = nn.CrossEntropyLoss(weight=weights, ignore_index=-1)
    history = []
    for epoch in range(options.epochs):
        model.train()
        total = 0.0
        for points, labels in batches:
            there = labels >= 0
            if not there.any():
                continue
            optimiser.zero_grad()
            loss = loss_of(model(points, there).flatten(0, 1), labels.flatten())
            loss.backward()
            optimiser.step()
            total += loss.item() * len(points)
        f1 = f1_of(model, validation, len(names))
        history.append({"epoch": epoch, "loss": total / len(batches.dataset), "f1": f1.tolist()})
        words = ", ".join(f"{n} {f:.3f}" for n, f in zip(names, f1))
        print(f"epoch {epoch}: loss {history[-1]['loss']:.4f}, F1 {words}")
    test = f1_of(model, loader(folder, "test", options, shuffle=False), len(names))
    print("F1 of the test set: " + ", ".join(f"{n} {f:.3f}" for n, f in zip(names, test)))
    return model, history


def main():
    options = arguments.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.data or Path(temporary) / "data"
        catseye.dataset(options.recipe, folder, engine=options.device)
        model, history = train(folder, options)
    torch.save({"state": model.state_dict(), "classes": options.classes, "columns": COLUMNS}, options.output)
    options.output.with_suffix(".json").write_text(json.dumps(history, indent=1))
    print(f"wrote {options.output}")
    if len(history) > 1 and not history[-1]["loss"] < history[0]["loss"]:
        raise SystemExit("the network learnt nothing: the loss did not fall")


if __name__ == "__main__":
    main()
