"""Reader of datasets."""

from __future__ import annotations

import operator
import os
from collections.abc import Callable, Iterator, Sequence
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from ._catseye import Store

Sample = dict[str, Any]


class Dataset(Sequence[Sample]):
    """The frames of a dataset that :func:`catseye.dataset` or ``catseye dataset`` wrote, whatever its format.

    ``dataset[i]`` is a dictionary: ``"frame"`` (number of the frame), each array by its name (``"adc"``: complex64
    [chirp, rx_virtual, sample] in sqrt(W); ``"range_doppler"``: float32 [doppler, range] in W) and each table by its name
    (``"points"``, ``"boxes"``, ...) as a structured array with the frame's rows, whose units are in the column names.
    ``dataset[a:b]`` is a dataset of fewer frames. Nothing is read before it is asked for. Instances can be pickled, and sent to
    processes that were forked or spawned.

    folder: of the dataset. split: "train", "validation" or "test", default all frames. arrays, tables: names of those to read,
    default all.

    Raises BadInput for a folder that is no dataset, and for a frame whose shard is missing or broken when it is read.
    """

    def __init__(
        self,
        folder: str | os.PathLike[str],
        *,
        split: str | None = None,
        arrays: Sequence[str] | None = None,
        tables: Sequence[str] | None = None,
    ) -> None:
        self._store = Store(folder)
        self._folder = os.fspath(folder)
        self._arrays = None if arrays is None else list(arrays)
        self._tables = None if tables is None else list(tables)
        layout = self._store.layout
        for what, wanted in (("arrays", self._arrays), ("tables", self._tables)):
            known = [entry["name"] for entry in layout[what]]
            for name in wanted or ():
                if name not in known:
                    raise KeyError(f"the dataset has no {what[:-1]} {name!r}; it has {', '.join(known)}")
        self._frames: NDArray[np.int64]
        if split is None:
            self._frames = np.arange(len(self._store), dtype=np.int64)
        else:
            splits = self._store.splits()
            if split not in splits:
                raise KeyError(f"no split {split!r}; splits are {', '.join(splits)}")
            self._frames = splits[split]

    @property
    def folder(self) -> str:
        """Where the dataset lies."""
        return self._folder

    @property
    def layout(self) -> dict[str, Any]:
        """What is stored: format, compression, frames, frames_per_shard, arrays and tables with their units."""
        return self._store.layout

    @property
    def frames(self) -> NDArray[np.int64]:
        """int64 [item]: the number in the whole dataset of each frame here."""
        return self._frames

    def split(self, name: str) -> Dataset:
        """The frames of "train", "validation" or "test" among these."""
        splits = self._store.splits()
        if name not in splits:
            raise KeyError(f"no split {name!r}; splits are {', '.join(splits)}")
        return self._of(self._frames[np.isin(self._frames, splits[name])])

    def torch(self, *, transform: Callable[[Sample], Any] | None = None) -> TorchDataset:
        """The same for ``torch.utils.data.DataLoader``, with arrays as tensors. transform: called with the dictionary before that."""
        return TorchDataset(self, transform=transform)

    def __len__(self) -> int:
        return len(self._frames)

    @overload
    def __getitem__(self, index: int) -> Sample: ...
    @overload
    def __getitem__(self, index: slice) -> Dataset: ...
    def __getitem__(self, index: int | slice) -> Sample | Dataset:
        if isinstance(index, slice):
            return self._of(self._frames[index])
        try:
            frame = int(self._frames[operator.index(index)])
        except IndexError:
            raise IndexError(f"frame {index} of {len(self)}") from None
        return self._store.read(frame, arrays=self._arrays, tables=self._tables)

    def __iter__(self) -> Iterator[Sample]:
        for frame in self._frames:
            yield self._store.read(int(frame), arrays=self._arrays, tables=self._tables)

    def __repr__(self) -> str:
        return f"<catseye.Dataset {self._folder}: {len(self)} frames>"

    def _of(self, frames: NDArray[np.int64]) -> Dataset:
        part = object.__new__(type(self))
        part.__dict__.update(self.__dict__, _frames=frames)
        return part


class TorchDataset:
    """A map-style dataset for ``torch.utils.data.DataLoader``, with any number of workers.

    An item is the dictionary of :class:`Dataset` with its arrays as tensors; tables stay structured arrays, which
    PyTorch's own collation cannot put into a batch: leave them out with ``tables=[]``, or make of them what the network
    takes in ``transform``, whose result is returned as it is, but for arrays in a dictionary.
    """

    def __init__(self, dataset: Dataset, *, transform: Callable[[Sample], Any] | None = None) -> None:
        self.dataset = dataset
        self.transform = transform

    def __len__(self) -> int:
        return len(self.dataset)

    def __getitem__(self, index: int) -> Any:
        import torch

        sample: Any = self.dataset[index]
        if self.transform is not None:
            sample = self.transform(sample)
        if not isinstance(sample, dict):
            return sample
        return {name: torch.from_numpy(value) if _is_numbers(value) else value for name, value in sample.items()}


def _is_numbers(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.dtype.kind in "?iufc"
