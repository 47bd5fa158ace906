"""catseye: automotive-radar simulator, from scenes to radar cross sections, samples, detections, points and datasets.

Functions take and return NumPy arrays. Lengths are in metres, angles in degrees where a name ends in ``_deg``, all else in SI units;
axes are those of ISO 8855 (x forward, y left, z up); range rates are positive when the target recedes. All arguments except the
first are given by keyword, and names contain their units.

>>> import catseye
>>> plate = catseye.rcs("plate:width_m=0.1,height_m=0.1", frequency_hz=77e9, engine="cpu")
>>> round(float(plate.vv_dbsm[0, 0, 0]), 2)
19.19
"""

from ._catseye import (
    BadInput,
    Detections,
    Engine,
    Failed,
    Frame,
    Frames,
    LaneEstimator,
    Radar,
    RcsResult,
    Scenario,
    Scene,
    __version__,
    dataset,
    devices,
    diff,
    lane,
    lane_compare,
    lane_methods,
    materials,
    presets,
    process,
    rcs,
    recipe_facts,
    reflector,
    reflector_kinds,
    road_scene,
    simulate,
    verify,
)
from . import dsp
from ._reader import Dataset, TorchDataset
from ._show import View, view

__all__ = [
    "BadInput",
    "Dataset",
    "Detections",
    "Engine",
    "Failed",
    "Frame",
    "Frames",
    "LaneEstimator",
    "Radar",
    "RcsResult",
    "Scenario",
    "Scene",
    "TorchDataset",
    "View",
    "__version__",
    "dataset",
    "devices",
    "diff",
    "dsp",
    "lane",
    "lane_compare",
    "lane_methods",
    "materials",
    "presets",
    "process",
    "rcs",
    "recipe_facts",
    "reflector",
    "reflector_kinds",
    "road_scene",
    "simulate",
    "verify",
    "view",
]
