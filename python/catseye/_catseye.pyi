import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Literal, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._show import View

__all__ = [
    "BadInput",
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
    "Store",
    "Tracker",
    "__version__",
    "dataset",
    "devices",
    "diff",
    "dsp_amplitudes",
    "dsp_angle_spectrum",
    "dsp_cfar",
    "dsp_chirp_amplitudes",
    "dsp_cluster",
    "dsp_confidence",
    "dsp_directions",
    "dsp_doppler_transform",
    "dsp_grid",
    "dsp_masks",
    "dsp_object_cells",
    "dsp_plots",
    "dsp_power",
    "dsp_range_doppler",
    "dsp_range_transform",
    "dsp_seen",
    "dsp_separate",
    "dsp_strongest",
    "dsp_tensor",
    "dsp_threshold",
    "lane",
    "lane_compare",
    "lane_methods",
    "materials",
    "picture_map",
    "picture_rcs",
    "picture_scene",
    "presets",
    "process",
    "rcs",
    "recipe_facts",
    "reflector",
    "reflector_kinds",
    "road_scene",
    "simulate",
    "verify",
    "write_page",
]

_Path: TypeAlias = str | os.PathLike[str]
_Engine: TypeAlias = Engine | str
_Progress: TypeAlias = Callable[[int, int], object]
_Floats: TypeAlias = NDArray[np.float64]

__version__: str

class BadInput(ValueError):
    """An input is not valid. str() is the message that the command line prints."""

    file: str | None
    line: int | None
    key: str | None
    value: str | None
    problem: str
    allowed: str | None
    remedy: str | None

class Failed(RuntimeError):
    """Any error other than bad input: of a device, of a file, or a result that fails a check."""

@final
class Engine:
    """The device that computes: the cpu, or a GPU."""

    def __new__(cls, device: str = "auto", *, precision: str = "f32", trace: str | None = None) -> Engine: ...
    @property
    def description(self) -> str: ...
    @property
    def adapter(self) -> str: ...
    @property
    def kind(self) -> Literal["cpu", "gpu"]: ...
    @property
    def precision(self) -> Literal["f32", "f64"]: ...
    @property
    def trace(self) -> Literal["host", "device", "lines"]: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class Scene:
    """A scene: all objects that can return an echo."""

    def __new__(cls) -> Scene: ...
    @staticmethod
    def load(
        path: _Path,
        *,
        unit: str | None = None,
        up: str | None = None,
        default_material: str | None = None,
        materials: Mapping[str, str] = ...,
        smooth_deg: float | None = None,
    ) -> Scene: ...
    @staticmethod
    def from_glb(
        data: bytes,
        *,
        unit: str | None = None,
        up: str | None = None,
        default_material: str | None = None,
        materials: Mapping[str, str] = ...,
        smooth_deg: float | None = None,
    ) -> Scene: ...
    @staticmethod
    def from_mesh(
        vertices_m: ArrayLike,
        triangles: ArrayLike,
        *,
        material: str | Sequence[str] | None = None,
        normals: ArrayLike | None = None,
        smooth_deg: float | None = None,
        name: str = "",
        class_name: str = "",
    ) -> Scene: ...
    @property
    def name(self) -> str: ...
    @property
    def boresight_deg(self) -> tuple[float, float]: ...
    @property
    def triangle_count(self) -> int: ...
    @property
    def materials(self) -> list[str]: ...
    @property
    def notes(self) -> list[str]: ...
    @property
    def objects(self) -> list[dict[str, Any]]: ...
    @property
    def truth(self) -> dict[str, Any] | None: ...
    def bounds_m(self, *, time_s: float = 0.0) -> _Floats | None: ...
    def boxes(self, *, time_s: float = 0.0) -> list[dict[str, Any]]: ...
    def triangles(self, *, time_s: float = 0.0) -> dict[str, NDArray[Any]]: ...
    def check(self, *, frequency_hz: float = ...) -> list[str]: ...
    def add_point(
        self,
        *,
        position_m: ArrayLike,
        rcs_dbsm: float,
        velocity_mps: ArrayLike | None = None,
        name: str = "",
        class_name: str = "",
    ) -> int: ...
    def add(
        self,
        other: Scene | _Path,
        *,
        position_m: ArrayLike | None = None,
        yaw_deg: float = 0.0,
        pitch_deg: float = 0.0,
        roll_deg: float = 0.0,
        velocity_mps: ArrayLike | None = None,
        name: str = "",
        class_name: str = "",
    ) -> list[int]: ...
    def to_glb(self) -> bytes: ...
    def save(self, path: _Path, *, force: bool = False) -> os.PathLike[str]: ...
    def view(self, *, output: _Path | None = None, force: bool = False) -> View: ...
    def _repr_html_(self) -> str: ...
    def __len__(self) -> int: ...

@final
class Radar:
    """A radar: a preset, or the path of a radar TOML."""

    def __new__(cls, name: _Path) -> Radar: ...
    @staticmethod
    def parse(text: str, *, folder: _Path = ...) -> Radar: ...
    def to_toml(self) -> str: ...
    def with_processing(self, **changes: Any) -> Radar: ...
    @property
    def processing(self) -> dict[str, Any]: ...
    def __reduce__(self) -> tuple[Any, ...]: ...
    @property
    def name(self) -> str: ...
    @property
    def carrier_hz(self) -> float: ...
    @property
    def wavelength_m(self) -> float: ...
    @property
    def bandwidth_hz(self) -> float: ...
    @property
    def sample_rate_hz(self) -> float: ...
    @property
    def frame_time_s(self) -> float: ...
    @property
    def shape(self) -> tuple[int, int, int]: ...
    @property
    def range_bin_m(self) -> float: ...
    @property
    def velocity_bin_mps(self) -> float: ...
    @property
    def max_range_m(self) -> float: ...
    @property
    def max_velocity_mps(self) -> float: ...
    @property
    def range_m(self) -> _Floats: ...
    @property
    def range_rate_mps(self) -> _Floats: ...
    @property
    def tx_position_m(self) -> _Floats: ...
    @property
    def rx_position_m(self) -> _Floats: ...

@final
class RcsResult:
    """Scattering matrices of a sweep over frequency and direction."""

    @property
    def target(self) -> str: ...
    @property
    def frequency_hz(self) -> _Floats: ...
    @property
    def azimuth_deg(self) -> _Floats: ...
    @property
    def elevation_deg(self) -> _Floats: ...
    @property
    def bistatic_azimuth_deg(self) -> _Floats | None: ...
    @property
    def bistatic_elevation_deg(self) -> _Floats | None: ...
    @property
    def s(self) -> NDArray[np.complex128]: ...
    @property
    def dbsm(self) -> _Floats: ...
    @property
    def vv_dbsm(self) -> _Floats: ...
    @property
    def vh_dbsm(self) -> _Floats: ...
    @property
    def hv_dbsm(self) -> _Floats: ...
    @property
    def hh_dbsm(self) -> _Floats: ...
    @property
    def convention(self) -> Literal["every", "last"]: ...
    @property
    def convergence_db(self) -> float | None: ...
    @property
    def turned_deg(self) -> tuple[float, float, float]: ...
    @property
    def engine_rule(self) -> str | None: ...
    @property
    def warnings(self) -> list[str]: ...
    def in_polarisation(self, name: str) -> NDArray[np.complex128]: ...
    def plot(
        self,
        polarisation: str | Sequence[str] | None = None,
        *,
        over: str | None = None,
        at: Mapping[str, float] | None = None,
        polar: bool = False,
        ax: Any = None,
    ) -> Any: ...
    def save_plot(
        self, path: _Path, *, polarisation: str | Sequence[str] | None = None, force: bool = False
    ) -> os.PathLike[str]: ...
    def view(self, *, output: _Path | None = None, force: bool = False) -> View: ...
    def _repr_html_(self) -> str: ...

@final
class Scenario:
    """A scenario: objects, the vehicle's motion, radars and frames."""

    def __new__(cls, path: _Path) -> Scenario: ...
    @staticmethod
    def parse(text: str, *, folder: _Path = ...) -> Scenario: ...
    @property
    def name(self) -> str: ...
    @property
    def seed(self) -> int: ...
    @property
    def frames(self) -> int: ...
    @property
    def interval_s(self) -> float: ...
    @property
    def radars(self) -> list[Radar]: ...
    def scene(self) -> Scene: ...

@final
class Frames:
    """An iterator of Frame; each frame is computed when it is requested."""

    def __iter__(self) -> Frames: ...
    def __next__(self) -> Frame: ...
    def __len__(self) -> int: ...
    @property
    def remarks(self) -> list[str]: ...

@final
class Frame:
    """One frame of one radar."""

    @property
    def index(self) -> int: ...
    @property
    def radar(self) -> str: ...
    @property
    def time_s(self) -> float: ...
    @property
    def position_m(self) -> _Floats: ...
    @property
    def rotation_xyzw(self) -> _Floats: ...
    @property
    def velocity_mps(self) -> _Floats: ...
    @property
    def adc(self) -> NDArray[np.complexfloating[Any, Any]]: ...
    @property
    def range_doppler(self) -> NDArray[np.floating[Any]]: ...
    @property
    def maps(self) -> list[NDArray[np.floating[Any]]]: ...
    @property
    def range_m(self) -> _Floats: ...
    @property
    def range_rate_mps(self) -> _Floats: ...
    @property
    def points(self) -> NDArray[np.void]: ...
    @property
    def returns(self) -> NDArray[np.void]: ...
    @property
    def truth(self) -> dict[str, Any]: ...
    @property
    def triangles(self) -> int: ...
    @property
    def seconds(self) -> dict[str, float]: ...
    def plot(self, kind: str = "range_doppler", *, points: bool = True, ax: Any = None) -> Any: ...
    def _repr_html_(self) -> str: ...

@final
class Detections:
    """Result of process: the power maps, detections and points of one cube."""

    @property
    def range_doppler(self) -> NDArray[np.floating[Any]]: ...
    @property
    def maps(self) -> list[NDArray[np.floating[Any]]]: ...
    @property
    def mask(self) -> NDArray[np.bool_]: ...
    @property
    def range_m(self) -> _Floats: ...
    @property
    def range_rate_mps(self) -> _Floats: ...
    @property
    def points(self) -> NDArray[np.void]: ...
    def plot(self, kind: str = "range_doppler", *, points: bool = True, ax: Any = None) -> Any: ...
    def _repr_html_(self) -> str: ...

@final
class Store:
    """The files of a dataset."""

    def __new__(cls, folder: _Path) -> Store: ...
    def __len__(self) -> int: ...
    @property
    def layout(self) -> dict[str, Any]: ...
    def radar_names(self) -> list[str] | None: ...
    def radar(self, frame: int, name: str) -> Radar: ...
    def radar_text(self, frame: int, name: str) -> str: ...
    def check_radar(self, frame: int, name: str, radar: Radar) -> None: ...
    def splits(self) -> dict[str, NDArray[np.int64]]: ...
    def read(
        self, frame: int, *, arrays: Sequence[str] | None = None, tables: Sequence[str] | None = None
    ) -> dict[str, Any]: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class Tracker:
    """A tracker of many bodies that move with constant velocity in the plane of the road."""

    def __new__(
        cls,
        *,
        acceleration_psd: float = 1.0,
        across_std_mps: float = 8.0,
        gate_probability: float = 0.99,
        confirm_hits: int = 3,
        confirm_scans: int = 5,
        max_misses: int = 5,
        max_coast_s: float = 1.0,
    ) -> Tracker: ...
    def step(
        self,
        time_s: float,
        plots: Any,
        *,
        position_m: Sequence[float] = ...,
        heading_deg: float = 0.0,
        velocity_mps: Sequence[float] = ...,
        max_range_m: float | None = None,
        max_azimuth_deg: float | None = None,
        tentative: bool = False,
        frame: int = 0,
    ) -> NDArray[np.void]: ...

_Angles: TypeAlias = int | ArrayLike

def dsp_range_transform(adc: ArrayLike, radar: Radar | _Path, ramp: int = 0, engine: _Engine | None = None) -> NDArray[Any]: ...
def dsp_doppler_transform(
    range_spectrum: ArrayLike, radar: Radar | _Path, ramp: int = 0, engine: _Engine | None = None
) -> NDArray[Any]: ...
def dsp_range_doppler(adc: ArrayLike, radar: Radar | _Path, ramp: int = 0, engine: _Engine | None = None) -> NDArray[Any]: ...
def dsp_power(spectrum: ArrayLike, radar: Radar | _Path, ramp: int = 0, engine: _Engine | None = None) -> NDArray[Any]: ...
def dsp_cfar(
    power: ArrayLike, radar: Radar | _Path | None, detector: tuple[Any, ...], engine: _Engine | None = None
) -> tuple[NDArray[np.bool_], NDArray[np.int64], NDArray[Any]]: ...
def dsp_threshold(
    power: ArrayLike, radar: Radar | _Path | None, detector: tuple[Any, ...], engine: _Engine | None = None
) -> NDArray[Any]: ...
def dsp_separate(
    power: ArrayLike,
    cells: ArrayLike,
    noise_w: ArrayLike,
    snapshots: ArrayLike,
    radar: Radar | _Path,
    ramp: int = 0,
    velocity_mps: Sequence[float] | None = None,
) -> tuple[NDArray[np.complex128], _Floats, _Floats, list[str], _Floats]: ...
def dsp_directions(
    snapshots: ArrayLike | None,
    covariance: ArrayLike | None,
    noise_w: ArrayLike | None,
    radar: Radar | _Path,
    engine: _Engine | None = None,
    range_m: ArrayLike | None = None,
) -> NDArray[np.void]: ...
def dsp_angle_spectrum(
    snapshots: ArrayLike | None,
    covariance: ArrayLike | None,
    noise_w: ArrayLike | None,
    radar: Radar | _Path,
    engine: _Engine | None = None,
) -> tuple[_Floats, _Floats, _Floats]: ...
def dsp_grid(
    radar: Radar | _Path, azimuth: _Angles | None = None, elevation: ArrayLike | None = None
) -> tuple[_Floats, _Floats]: ...
def dsp_tensor(
    spectrum: ArrayLike,
    radar: Radar | _Path,
    keep: Sequence[bool],
    reduce: str,
    ramp: int = 0,
    azimuth: _Angles | None = None,
    elevation: ArrayLike | None = None,
    engine: _Engine | None = None,
) -> NDArray[Any]: ...
def dsp_amplitudes(
    spectrum: ArrayLike,
    radar: Radar | _Path,
    ramp: int = 0,
    azimuth: _Angles | None = None,
    elevation: ArrayLike | None = None,
    engine: _Engine | None = None,
) -> NDArray[Any]: ...
def dsp_chirp_amplitudes(
    range_spectrum: ArrayLike,
    radar: Radar | _Path,
    chirps: Sequence[int],
    ramp: int = 0,
    azimuth: _Angles | None = None,
    elevation: ArrayLike | None = None,
    engine: _Engine | None = None,
) -> NDArray[Any]: ...
def dsp_strongest(tensor: ArrayLike, share: float) -> NDArray[np.int64]: ...
def dsp_seen(
    classes: NDArray[np.int64],
    rows: ArrayLike,
    position_m: Sequence[float],
    rotation_xyzw: Sequence[float],
    velocity_mps: Sequence[float],
) -> _Floats: ...
def dsp_masks(
    classes: NDArray[np.int64], rows: ArrayLike, radar: Radar | _Path, ramp: int = 0, azimuth: _Angles | None = None
) -> tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.uint8]]: ...
def dsp_confidence(
    classes: NDArray[np.int64],
    rows: ArrayLike,
    count: int,
    sigma_m: ArrayLike,
    radar: Radar | _Path,
    ramp: int = 0,
    azimuth: _Angles | None = None,
) -> NDArray[np.float32]: ...
def dsp_object_cells(
    classes: NDArray[np.int64], rows: ArrayLike, radar: Radar | _Path, ramp: int = 0, azimuth: _Angles | None = None
) -> NDArray[np.int64]: ...
def dsp_cluster(points: Any, position_m: float, range_rate_mps: float, min_points: int) -> NDArray[np.int64]: ...
def dsp_plots(points: Any, labels: Sequence[int] | None = None) -> NDArray[np.void]: ...
def devices() -> dict[str, Any]: ...
def presets() -> list[str]: ...
def materials() -> list[str]: ...
def reflector(spec: str, **parameters: object) -> Scene: ...
def reflector_kinds() -> dict[str, Any]: ...
def road_scene(path_or_text: _Path, *, folder: _Path = ...) -> Scene: ...
def rcs(
    target: Scene | _Path,
    *,
    frequency_hz: ArrayLike | None = None,
    azimuth_deg: ArrayLike | None = None,
    elevation_deg: ArrayLike | None = None,
    range_m: float = ...,
    bistatic_azimuth_deg: ArrayLike | None = None,
    bistatic_elevation_deg: ArrayLike | None = None,
    bounces: int | None = None,
    convention: str = "every",
    accuracy_db: float = 0.1,
    diffraction: str = "none",
    ground: str = "none",
    height_m: float = 0.0,
    yaw_deg: float = 0.0,
    pitch_deg: float = 0.0,
    roll_deg: float = 0.0,
    engine: _Engine | None = None,
    progress: _Progress | None = None,
) -> RcsResult: ...
def simulate(
    scenario: Scenario | _Path,
    *,
    frames: int | Iterable[int] | None = None,
    seed: int | None = None,
    radar: str | None = None,
    scene: Scene | None = None,
    engine: _Engine | None = None,
    trace: str | None = None,
    source: _Path | None = None,
) -> Frames: ...
def process(adc: NDArray[Any], *, radar: Radar | _Path, engine: _Engine | None = None) -> Detections: ...
@final
class LaneEstimator:
    def __new__(cls, method: str, options: dict[str, Any] | None = None) -> LaneEstimator: ...
    @property
    def method(self) -> str: ...
    def estimate(
        self,
        time_s: float,
        *,
        points: Any | None = None,
        mounting: Sequence[float] | None = None,
        yaw_deg: float = 0.0,
        speed_mps: float | None = None,
        speed_std_mps: float = 0.1,
        yaw_rate_dps: float | None = None,
        tracks: Any | None = None,
        pulse: Any | None = None,
        image: Any | None = None,
        place: Sequence[float] | None = None,
    ) -> dict[str, Any]: ...

def lane(
    method: str,
    scenario: _Path,
    out: _Path,
    *,
    runs: int | None = None,
    frames: int | None = None,
    seed: int | None = None,
    engine: _Engine | None = None,
    trace: str | None = None,
    force: bool = False,
    progress: _Progress | None = None,
) -> dict[str, Any]: ...
def lane_compare(
    scenarios: Sequence[_Path],
    out: _Path,
    *,
    runs: int | None = None,
    frames: int | None = None,
    seed: int | None = None,
    engine: _Engine | None = None,
    trace: str | None = None,
    force: bool = False,
    progress: _Progress | None = None,
) -> dict[str, Any]: ...
def lane_methods() -> list[str]: ...
def dataset(
    recipe: _Path,
    out: _Path,
    *,
    shards: tuple[int, int] | None = None,
    jobs: int | None = None,
    batch: int | None = None,
    seed: int | None = None,
    engine: _Engine | None = None,
    trace: str | None = None,
    mixed_devices: bool = False,
    source: _Path | None = None,
    force: bool = False,
    progress: _Progress | None = None,
) -> dict[str, Any]: ...
def recipe_facts(path: _Path, *, seed: int | None = None) -> dict[str, Any]: ...
def picture_map(
    title: str,
    power_w: NDArray[np.float32],
    range_m: Sequence[float],
    range_rate_mps: Sequence[float],
    detections: Sequence[Sequence[float]],
) -> bytes: ...
def picture_rcs(result: RcsResult) -> bytes: ...
def picture_scene(scene: Scene) -> bytes: ...
def write_page(
    thing: Scene | RcsResult | _Path | Sequence[Scene | RcsResult] | Sequence[_Path],
    output: _Path,
    force: bool = False,
    progress: _Progress | None = None,
) -> dict[str, Any]: ...
def verify(folder: _Path, *, progress: _Progress | None = None) -> dict[str, Any]: ...
def diff(
    a: _Path,
    b: _Path,
    *,
    tolerance_db: float | None = None,
    above_db: float | None = None,
    phase_deg: float | None = None,
    relative: float | None = None,
    tolerance_m: float | None = None,
    tolerance_mps: float | None = None,
    tolerance_deg: float | None = None,
    match_m: float | None = None,
    match_mps: float | None = None,
    match_deg: float | None = None,
    progress: _Progress | None = None,
) -> dict[str, Any]: ...
