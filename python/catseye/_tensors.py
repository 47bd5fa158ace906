"""Tensors that a dataset computes from its stored samples when a frame is read."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from . import dsp
from ._catseye import Engine, Radar, Store

Sample = dict[str, Any]

#: Functions that compute tensors from samples, by name.
_OF_SAMPLES: dict[str, Callable[..., Any]] = {
    "range_azimuth": dsp.range_azimuth,
    "angle_doppler": dsp.angle_doppler,
    "rad": dsp.rad,
    "chirps_azimuth": dsp.chirps_azimuth,
    "tensor4d": dsp.tensor4d,
}
#: All names of tensors; those of labels are last.
NAMES = ("range_doppler", *_OF_SAMPLES, "sparse", "masks", "confidence", "objects")
_LABELS = ("masks", "confidence", "objects")


def _suffix(radar: str) -> str:
    """The end of the names of a radar's arrays in a dataset of several radars."""
    return "_" + radar.lower().replace("-", "_")



RadarLike = Radar | str | os.PathLike[str]


class _Part:
    """One radar of the dataset whose samples become tensors.

    name: its name in the dataset, None in a dataset without radars. array: name of its samples. suffix: end of the names of its tensors. given: the
    radar that computes them, a Radar or an absolute path; None takes the dataset's own.
    """

    def __init__(self, name: str | None, array: str, suffix: str, given: Radar | str | None) -> None:
        self.name, self.array, self.suffix, self.given = name, array, suffix, given
        self._loaded: Radar | None = given if isinstance(given, Radar) else None
        self._text: str | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_loaded": self.given if isinstance(self.given, Radar) else None, "_text": None}

    def _of_given(self) -> Radar:
        if self._loaded is None:
            self._loaded = Radar(self.given)  # type: ignore[arg-type]
        return self._loaded

    def radar(self, store: Store, frame: int) -> Radar:
        """The radar that computes the tensors of a frame, after a comparison with the radar that recorded its samples."""
        if self.name is None:
            return self._of_given()
        text = store.radar_text(frame, self.name)
        if self.given is not None:
            if text != self._text:
                store.check_radar(frame, self.name, self._of_given())
                self._text = text
            return self._of_given()
        if self._loaded is None or text != self._text:
            self._loaded, self._text = store.radar(frame, self.name), text
        return self._loaded


class Tensors:
    """Tensors that ``Dataset(..., tensors=...)`` adds to each frame.

    wanted: names, or options by name. radar: None for all radars of the dataset, a name in the dataset, a Radar, preset or path, a list of names, or
    a dictionary of any of these (None for the dataset's own) by name in the dataset. engine: device that computes them. store: files of the dataset.
    """

    def __init__(
        self,
        wanted: Sequence[str] | Mapping[str, Mapping[str, Any]],
        radar: RadarLike | Sequence[str] | Mapping[str, RadarLike | None] | None,
        engine: Engine | str | None,
        store: Store,
    ) -> None:
        if isinstance(wanted, str):
            wanted = [wanted]
        named = dict(wanted) if isinstance(wanted, Mapping) else dict.fromkeys(wanted, {})
        self.options: dict[str, dict[str, Any]] = {name: dict(options) for name, options in named.items()}
        self.engine = engine
        for name in self.options:
            if name not in NAMES:
                raise dsp._bad("tensors", name, "there is no such tensor", ", ".join(NAMES))
        layout = store.layout
        stored = {entry["name"]: entry for entry in layout["arrays"]}
        if not any(name == "adc" or name.startswith("adc_") for name in stored):
            problem = "the dataset contains no samples, from which tensors are computed"
            raise dsp._bad("tensors", ", ".join(self.options), problem, None, "make it again with adc = true in [keep] of its recipe")
        names = store.radar_names()
        self.parts = self._of_old(radar, stored) if names is None else self._of_names(radar, names)
        self._check(store, stored)
        self.tables = ["radars"]
        if any(label in self.options for label in _LABELS):
            self.tables.append("boxes")
            if "boxes" not in [entry["name"] for entry in layout["tables"]]:
                problem = "the dataset contains no truth, from which labels are made"
                raise dsp._bad("tensors", ", ".join(self.options), problem, None, "make it again with truth = true in [keep] of its recipe")
        for name in ("masks", "confidence"):
            if name in self.options and not self.options[name].get("classes"):
                remedy = f'tensors={{"{name}": {{"classes": ["car"]}}}}'
                raise dsp._bad(f"tensors.{name}.classes", None, "is missing; labels need the names of their classes", None, remedy)

    @property
    def arrays(self) -> list[str]:
        """Names of the samples from which the tensors are computed."""
        return [part.array for part in self.parts]

    @property
    def objects(self) -> list[str]:
        """Names of the tables of objects."""
        return [f"objects{part.suffix}" for part in self.parts] if "objects" in self.options else []

    @staticmethod
    def _path(radar: RadarLike) -> Radar | str:
        # An absolute path stays valid in a process with another working folder.
        if isinstance(radar, Radar):
            return radar
        return os.path.abspath(radar) if os.path.exists(radar) else os.fspath(radar)

    def _of_old(self, radar: Any, stored: Mapping[str, Any]) -> list[_Part]:
        """The given radar, for a dataset that does not contain its radars."""
        if radar is None or not isinstance(radar, (Radar, str, os.PathLike)):
            problem = "tensors need the radar of the samples, and the dataset was made before datasets contained their radars"
            remedy = "give radar=, the preset or file that the dataset's recipe names"
            raise dsp._bad("radar", radar, problem, None, remedy)
        warnings.warn(
            "the dataset was made before datasets contained their radars: whether radar= has the antennas and windows of the samples cannot be checked",
            stacklevel=4,
        )
        part = _Part(None, "adc", "", self._path(radar))
        several = "adc" + _suffix(part._of_given().name)
        part.array = several if several in stored else "adc"
        return [part]

    def _of_names(self, radar: Any, names: list[str]) -> list[_Part]:
        """The radars of a dataset that contains them."""
        known = ", ".join(names)

        def part(name: str, given: Any, suffix: bool) -> _Part:
            if name not in names:
                raise dsp._bad("radar", name, "the dataset has no radar of this name", known)
            array = "adc" if len(names) == 1 else "adc" + _suffix(name)
            return _Part(name, array, _suffix(name) if suffix else "", None if given is None else self._path(given))

        if radar is None:
            return [part(name, None, len(names) > 1) for name in names]
        if isinstance(radar, Mapping):
            return [part(name, given, True) for name, given in radar.items()]
        if isinstance(radar, str) and radar in names:
            return [part(radar, None, False)]
        if not isinstance(radar, (Radar, str, os.PathLike)):
            return [part(name, None, True) for name in radar]
        if len(names) == 1:
            return [part(names[0], radar, False)]
        given = self._path(radar)
        own = (given if isinstance(given, Radar) else Radar(given)).name
        if own not in names:
            remedy = f'name one of them, as in radar={{"{names[0]}": ...}}, or leave it out for all'
            raise dsp._bad("radar", own, "the dataset has several radars, and none of this name", known, remedy)
        return [part(own, given, False)]

    def _check(self, store: Store, stored: Mapping[str, Any]) -> None:
        """Compares the radars with those of the first frame."""
        for part in self.parts:
            if part.array not in stored:
                problem = "the dataset contains no samples of this radar"
                raise dsp._bad("radar", part.name, problem, ", ".join(name for name in stored if name.startswith("adc")))
            radar, shape = part.radar(store, 0), tuple(stored[part.array]["shape"])
            if shape != radar.shape:
                problem = "is not the radar of the samples, which have another shape [chirp, channel, sample]"
                raise dsp._bad("radar", f"{radar.name} {radar.shape}", problem, str(shape), "give the one that the recipe names")

    def add(self, sample: Sample, store: Store) -> Sample:
        """Computes the tensors of a frame from its samples and the tables of :attr:`tables`."""
        out: Sample = {}
        for part in self.parts:
            out.update({name + part.suffix: value for name, value in self._of_part(part, sample, store).items()})
        return out

    def _of_part(self, part: _Part, sample: Sample, store: Store) -> Sample:
        out: Sample = {}
        radar, adc = part.radar(store, int(sample["frame"])), sample[part.array]
        common = {"radar": radar, "engine": self.engine}
        rows = sample["radars"]
        name = radar.name if part.name is None else part.name
        row = rows[rows["radar"].astype(str) == name][:1] if len(rows) > 1 else rows[:1]
        if part.name is None:
            self._check_old(radar, row)
        for name, options in self.options.items():
            if name == "range_doppler":
                options = {**common, **options}
                out[name] = dsp.power(dsp.range_doppler(adc, **options), **options)
            elif name == "sparse":
                share = {key: options[key] for key in ("share",) if key in options}
                rest = {key: value for key, value in options.items() if key != "share"}
                few = dsp.sparse(dsp.tensor4d(adc, **{**common, **rest}), **share)
                out["sparse_indices"], out["sparse_power_w"] = few
            elif name in _OF_SAMPLES:
                out[name] = _OF_SAMPLES[name](adc, **{**common, **options})
        if "boxes" in self.tables:
            out.update(self._labels(sample["boxes"], row[0], radar))
        return out

    def _check_old(self, radar: Radar, row: Any) -> None:
        """Compares a radar with what a dataset without radars records: carrier and axes of the map."""
        if len(row) == 0:
            raise dsp._bad("radar", radar.name, "is not the radar of the samples", None, "give the one that the recipe names")
        own = {"carrier_hz": radar.carrier_hz, "range_bin_m": radar.range_bin_m, "range_rate_bin_mps": radar.velocity_bin_mps}
        # Their axis of range rates refers to the carrier, which is within half the sweep of the middle of the samples.
        allowed = {"range_rate_bin_mps": 0.5 * abs(radar.bandwidth_hz) / radar.carrier_hz}
        for key, value in own.items():
            if key in row.dtype.names and abs(row[key][0] / value - 1) > max(1e-9, allowed.get(key, 0)):
                problem = f"radar {radar.name!r} is not the radar of the samples"
                raise dsp._bad(f"radar.{key}", value, problem, str(row[key][0]), "give the one that the recipe names")

    def _labels(self, boxes: Any, row: Any, radar: Radar) -> Sample:
        pose = {
            "position_m": [row[f"{axis}_m"] for axis in "xyz"],
            "rotation_xyzw": [row[f"rotation_{axis}"] for axis in "xyzw"],
            "velocity_mps": [row[f"velocity_{axis}_mps"] for axis in "xyz"],
        }
        out: Sample = {}
        for name in _LABELS:
            if name not in self.options:
                continue
            options = dict(self.options[name])
            visible = options.pop("visible", True)
            seen = dsp.objects(boxes, **pose, classes=options.get("classes"), visible=visible)
            if name == "objects":
                out[name] = seen
            elif name == "confidence":
                out[name] = dsp.confidence(seen, **{"radar": radar, **options})
            else:
                found = dsp.masks(seen, **{"radar": radar, **options})
                out.update({f"mask_{view}": mask for view, mask in found._asdict().items()})
        return out
