"""Tensors that a dataset computes of its stored samples when a frame is read."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from . import dsp
from ._catseye import Engine, Radar

Sample = dict[str, Any]

#: Tensors of samples by name.
_OF_SAMPLES: dict[str, Callable[..., Any]] = {
    "range_azimuth": dsp.range_azimuth,
    "angle_doppler": dsp.angle_doppler,
    "rad": dsp.rad,
    "chirps_azimuth": dsp.chirps_azimuth,
    "tensor4d": dsp.tensor4d,
}
#: All names, those of labels last.
NAMES = ("range_doppler", *_OF_SAMPLES, "sparse", "masks", "confidence", "objects")
_LABELS = ("masks", "confidence", "objects")


class Tensors:
    """What ``Dataset(..., tensors=...)`` adds to each frame.

    wanted: names, or options by name. radar: of the samples. engine: to compute with. layout: of the dataset.
    """

    def __init__(
        self,
        wanted: Sequence[str] | Mapping[str, Mapping[str, Any]],
        radar: Radar | str | os.PathLike[str] | None,
        engine: Engine | str | None,
        layout: Mapping[str, Any],
    ) -> None:
        if isinstance(wanted, str):
            wanted = [wanted]
        named = dict(wanted) if isinstance(wanted, Mapping) else dict.fromkeys(wanted, {})
        self.options: dict[str, dict[str, Any]] = {name: dict(options) for name, options in named.items()}
        self.engine = engine
        self._loaded: Radar | None = None
        for name in self.options:
            if name not in NAMES:
                raise dsp._bad("tensors", name, "there is no such tensor", ", ".join(NAMES))
        if radar is None:
            remedy = "give radar=, the preset or file that the dataset's recipe names"
            raise dsp._bad("radar", None, "tensors of samples ask which radar took them", None, remedy)
        # A path stays what it is when the dataset goes to a process that works elsewhere.
        self._radar = radar if isinstance(radar, Radar) or not os.path.exists(radar) else os.path.abspath(radar)
        stored = {entry["name"]: entry for entry in layout["arrays"]}
        name = self.radar.name
        several = "adc_" + name.lower().replace("-", "_")
        self.array = several if several in stored else "adc"
        if self.array not in stored:
            problem = "the dataset holds no samples, of which tensors are computed"
            raise dsp._bad("tensors", ", ".join(self.options), problem, None, "make it again with adc = true in [keep] of its recipe")
        shape = tuple(stored[self.array]["shape"])
        if shape != self.radar.shape:
            problem = "is not the radar of the samples, whose shape [chirp, channel, sample] is another"
            raise dsp._bad("radar", f"{name} {self.radar.shape}", problem, str(shape), "give the one that the recipe names")
        self.tables = ["radars"]
        if any(label in self.options for label in _LABELS):
            self.tables.append("boxes")
            if "boxes" not in [entry["name"] for entry in layout["tables"]]:
                problem = "the dataset holds no truth, of which labels are made"
                raise dsp._bad("tensors", ", ".join(self.options), problem, None, "make it again with truth = true in [keep] of its recipe")
        for name in ("masks", "confidence"):
            if name in self.options and not self.options[name].get("classes"):
                remedy = f'tensors={{"{name}": {{"classes": ["car"]}}}}'
                raise dsp._bad(f"tensors.{name}.classes", None, "labels ask for the names of their classes", None, remedy)

    @property
    def radar(self) -> Radar:
        """The radar of the samples."""
        if self._loaded is None:
            self._loaded = self._radar if isinstance(self._radar, Radar) else Radar(self._radar)
        return self._loaded

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_loaded": None}

    def add(self, sample: Sample) -> Sample:
        """The tensors of a frame that holds its samples and the tables of :attr:`tables`."""
        out: Sample = {}
        radar, adc = self.radar, sample[self.array]
        common = {"radar": radar, "engine": self.engine}
        rows = sample["radars"]
        row = rows[rows["radar"].astype(str) == radar.name][:1] if len(rows) > 1 else rows[:1]
        if len(row) == 0 or abs(row["carrier_hz"][0] / radar.carrier_hz - 1) > 1e-9:
            raise dsp._bad("radar", radar.name, "is not the radar of the samples", None, "give the one that the recipe names")
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
            out.update(self._labels(sample["boxes"], row[0]))
        return out

    def _labels(self, boxes: Any, row: Any) -> Sample:
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
                out[name] = dsp.confidence(seen, **{"radar": self.radar, **options})
            else:
                found = dsp.masks(seen, **{"radar": self.radar, **options})
                out.update({f"mask_{view}": mask for view, mask in found._asdict().items()})
        return out
