"""Reader of datasets."""

from __future__ import annotations

import json
import operator
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from ._catseye import Engine, Radar, Store
from ._plot import _check_kind, plot_sample
from ._tensors import RadarLike, Tensors

Sample = dict[str, Any]


class Dataset(Sequence[Sample]):
    """The frames of a dataset that :func:`catseye.dataset` or ``catseye dataset`` wrote, in any of its formats.

    ``dataset[i]`` is a dictionary: ``"frame"`` (number of the frame), each array by its name (``"adc"``: complex64 [chirp, rx_virtual, sample] in
    sqrt(W); ``"range_doppler"``: float32 [doppler, range] in W) and each table by its name (``"points"``, ``"boxes"``, ...) as a structured array
    with the frame's rows, whose units are in the column names. ``dataset[a:b]`` is a dataset of fewer frames. Data are read only when a frame is
    requested. Instances can be pickled, and sent to processes that were forked or spawned.

    folder: of the dataset. split: "train", "validation" or "test", default all frames. arrays, tables: names of those to read, default all.

    tensors: names of tensors that are computed from the stored samples when a frame is read, and added to its dictionary: "range_doppler",
    "range_azimuth", "angle_doppler", "rad", "chirps_azimuth", "tensor4d", "sparse" ("sparse_indices", "sparse_power_w"), and their labels, "masks"
    ("mask_range_azimuth", "mask_range_doppler", "mask_angle_doppler"), "confidence" and "objects" (boxes in the radar's frame). A dictionary in place
    of the list gives the options of each, as keywords of the functions of :mod:`catseye.dsp`. engine: device that computes them.

    radar: the radar of the samples. By default the radars that the dataset contains; with several, the names of tensors end with the name of the
    radar ("range_azimuth_left"). A name selects one of several; a list of names selects these. A Radar, preset or path, also in a dictionary by name,
    computes with other settings of the processing. It is compared with the dataset's radar in everything that determines the cell of a target:
    waveform, sampling, antenna positions and their order, windows, transform lengths. Other windows are options of a tensor.

    Raises BadInput for a folder that is not a dataset, for a radar that differs from that of the samples (with key and both values), and, when a
    frame is read, for a missing or damaged shard.
    """

    def __init__(
        self,
        folder: str | os.PathLike[str],
        *,
        split: str | None = None,
        arrays: Sequence[str] | None = None,
        tables: Sequence[str] | None = None,
        tensors: Sequence[str] | Mapping[str, Mapping[str, Any]] | None = None,
        radar: RadarLike | Sequence[str] | Mapping[str, RadarLike | None] | None = None,
        engine: Engine | str | None = None,
    ) -> None:
        self._store = Store(os.path.abspath(folder))
        # An absolute path, which stays valid when the process changes its folder.
        self._folder = os.path.abspath(folder)
        self._arrays = None if arrays is None else list(arrays)
        self._tables = None if tables is None else list(tables)
        layout = self._store.layout
        for what, wanted in (("arrays", self._arrays), ("tables", self._tables)):
            known = [entry["name"] for entry in layout[what]]
            for name in wanted or ():
                if name not in known:
                    raise KeyError(f"the dataset has no {what[:-1]} {name!r}; it has {', '.join(known)}")
        self._tensors = Tensors(tensors, radar, engine, self._store) if tensors else None
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
        """Absolute path of the dataset's folder."""
        return self._folder

    @property
    def layout(self) -> dict[str, Any]:
        """Layout of the stored data: format, compression, frames, frames_per_shard, arrays and tables with their units."""
        return self._store.layout

    @property
    def radars(self) -> list[str]:
        """Names of the radars that the dataset contains; empty for a dataset made before datasets contained radars."""
        return self._store.radar_names() or []

    def radar(self, index: int = 0, name: str | None = None) -> Radar:
        """The radar that recorded the samples of the frame at this index. name: of the radar, default the dataset's first. Raises BadInput for a name
        that the dataset does not contain, and for a dataset that contains no radars."""
        frame = int(self._frames[operator.index(index)])
        return self._store.radar(frame, (self.radars or [""])[0] if name is None else name)

    @property
    def frames(self) -> NDArray[np.int64]:
        """Numbers of these frames in the whole dataset, int64 [item]."""
        return self._frames

    def split(self, name: str) -> Dataset:
        """Returns those of these frames that belong to "train", "validation" or "test". Raises KeyError for another name."""
        splits = self._store.splits()
        if name not in splits:
            raise KeyError(f"no split {name!r}; splits are {', '.join(splits)}")
        return self._of(self._frames[np.isin(self._frames, splits[name])])

    @property
    def tables(self) -> list[str]:
        """Names of the tables that are read with the frames."""
        return self._stored_tables() + self._made_tables()

    def _made_tables(self) -> list[str]:
        return [] if self._tensors is None else self._tensors.objects

    def _stored_tables(self) -> list[str]:
        return [t["name"] for t in self.layout["tables"]] if self._tables is None else list(self._tables)

    def plot(
        self, index: int = 0, kind: str = "range_doppler", *, radar: str | None = None, points: bool = True, colorbar: bool = True, ax: Any = None
    ) -> Any:
        """Draws one of these frames with matplotlib; returns the Axes.

        kind: "range_doppler", the stored map in dBm with the points, or "birds_eye", the points in the radar's frame (x forward, y left, m), coloured
        by range rate, over the boxes of the objects. Points and boxes that the dataset does not contain are left out. radar: name of one radar of
        several, default the first. ax: Axes to draw into, default those of a new figure. Raises ImportError without matplotlib, and BadInput where
        the dataset contains nothing of the requested kind.
        """
        _check_kind(kind)
        layout = self._store.layout
        stored = {what: [entry["name"] for entry in layout[what]] for what in ("arrays", "tables")}
        maps = [name for name in stored["arrays"] if name.startswith("range_doppler")]
        tables = [name for name in ("radars", "points", "boxes") if name in stored["tables"]]
        try:
            frame = int(self._frames[operator.index(index)])
        except IndexError:
            raise IndexError(f"frame {index} of {len(self)}") from None
        sample = self._store.read(frame, arrays=maps, tables=tables)
        return plot_sample(sample, maps, kind, radar, points, colorbar, ax)

    def torch(
        self, *, rows: Mapping[str, int] | None = None, transform: Callable[[Sample], Any] | None = None
    ) -> TorchDataset:
        """The same frames for ``torch.utils.data.DataLoader`` and its own collation: arrays as tensors, tables as dictionaries of tensors that are
        padded to one length (:class:`TorchDataset` describes shapes and types).

        rows: lengths of tables by name. transform: called with the dictionary of a frame before the conversion.
        """
        return TorchDataset(self, rows=rows, transform=transform)

    def _rows_and_classes(self) -> tuple[dict[str, int], tuple[str, ...]]:
        """The maximum number of rows in any frame of the whole dataset by table, and the class names of all tables, sorted."""
        try:
            with open(os.path.join(self._folder, "statistics.json"), encoding="utf-8") as file:
                statistics = json.load(file)
            most = dict(statistics["rows_a_frame_most"])
            # Objects are boxes, as many or fewer.
            return {**most, **dict.fromkeys(self._made_tables(), most.get("boxes", 0))}, tuple(sorted(statistics["classes"]))
        except (OSError, KeyError):
            pass
        # The dataset is not complete, or its statistics do not contain these numbers: read every frame.
        asked = list(dict.fromkeys(self._stored_tables() + (["boxes"] if self._made_tables() else [])))
        most = dict.fromkeys(asked, 0)
        classes: set[str] = set()
        for frame in range(len(self._store)):
            for name, table in self._store.read(frame, arrays=[], tables=asked).items():
                if name != "frame":
                    most[name] = max(most[name], len(table))
                    if "class" in table.dtype.names:
                        classes.update(table["class"])
        return {**most, **dict.fromkeys(self._made_tables(), most.get("boxes", 0))}, tuple(sorted(classes))

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
        return self._read(frame)

    def _read(self, frame: int) -> Sample:
        tensors = self._tensors
        if tensors is None:
            return self._store.read(frame, arrays=self._arrays, tables=self._tables)
        arrays = [a["name"] for a in self.layout["arrays"]] if self._arrays is None else self._arrays
        tables = self._stored_tables()
        asked = {"arrays": [*arrays, *tensors.arrays], "tables": [*tables, *tensors.tables]}
        sample = self._store.read(frame, **{key: list(dict.fromkeys(names)) for key, names in asked.items()})
        wanted = {"frame", *arrays, *tables}
        return {**{name: value for name, value in sample.items() if name in wanted}, **tensors.add(sample, self._store)}

    def __iter__(self) -> Iterator[Sample]:
        for frame in self._frames:
            yield self._read(int(frame))

    def __repr__(self) -> str:
        return f"<catseye.Dataset {self._folder}: {len(self)} frames>"

    def _of(self, frames: NDArray[np.int64]) -> Dataset:
        part = object.__new__(type(self))
        part.__dict__.update(self.__dict__, _frames=frames)
        return part


class TorchDataset:
    """A map-style dataset for ``torch.utils.data.DataLoader`` and its own collation, with any number of workers.

    An item is a dictionary. ``"frame"`` is the number of the frame; arrays are tensors with the shape and type of :class:`Dataset`. Each table is a
    dictionary of tensors [row], one per column, with the same length in all frames, so that a batch has the shape [frame, row]: floating-point
    columns are float32, integers int64, flags bool. ``"valid"``, bool [row], is True for the frame's own rows, which come first; the padding rows
    after them contain NaN, 0 and False. The column ``class`` is int64, the index of the class in ``classes``, -1 in padding rows. Other columns of
    text are left out.

    rows: lengths of tables by name, in place of the maximum number of rows in any frame of the whole dataset; a frame with more rows raises
    ValueError. transform: called with the dictionary of :class:`Dataset`. If it returns a dictionary, the arrays and tables of that become tensors as
    above; any other value is returned unchanged.
    """

    def __init__(
        self,
        dataset: Dataset,
        *,
        rows: Mapping[str, int] | None = None,
        transform: Callable[[Sample], Any] | None = None,
    ) -> None:
        self.dataset = dataset
        self.transform = transform
        rows = dict(rows or {})
        tables = dataset.tables
        for name in rows:
            if name not in tables:
                raise KeyError(f"the items have no table {name!r}; they have {', '.join(tables) or 'none'}")
        self.rows: dict[str, int] = {}
        self.classes: tuple[str, ...] = ()
        if tables:
            most, self.classes = dataset._rows_and_classes()
            self.rows = {name: rows.get(name, most[name]) for name in tables}

    def __len__(self) -> int:
        return len(self.dataset)

    def __getitem__(self, index: int) -> Any:
        import torch

        sample: Any = self.dataset[index]
        frame = sample["frame"]
        if self.transform is not None:
            sample = self.transform(sample)
        if not isinstance(sample, dict):
            return sample
        item = {}
        for name, value in sample.items():
            if isinstance(value, np.ndarray) and value.dtype.names is not None and name in self.rows:
                columns = self._columns(frame, name, value)
                item[name] = {key: torch.from_numpy(column) for key, column in columns.items()}
            elif isinstance(value, np.ndarray) and value.dtype.kind in "biufc":
                item[name] = torch.from_numpy(value)
            else:
                item[name] = value
        return item

    def _columns(self, frame: int, name: str, table: NDArray[Any]) -> dict[str, NDArray[Any]]:
        """The numeric columns of a table, padded to the length of the table."""
        count, length = len(table), self.rows[name]
        if count > length:
            raise ValueError(f"frame {frame} has {count} rows in table {name!r}, and {length} have room: give rows={{{name!r}: ...}}")
        numbers = {class_: i for i, class_ in enumerate(self.classes)}
        columns: dict[str, NDArray[Any]] = {"valid": np.arange(length) < count}
        for key in table.dtype.names or ():
            kind = table.dtype[key].kind
            if kind == "f":
                column = np.full(length, np.nan, np.float32)
            elif kind in "iu":
                column = np.zeros(length, np.int64)
            elif kind == "b":
                column = np.zeros(length, bool)
            elif key == "class":
                column = np.full(length, -1, np.int64)
                column[:count] = [numbers[class_] for class_ in table[key]]
                columns[key] = column
                continue
            else:
                continue
            column[:count] = table[key]
            columns[key] = column
        return columns
