"""The stages of the processing one by one, tensors of stored samples, and labels of tensors.

Each stage takes and returns NumPy arrays. The results are bit-identical to those that :func:`catseye.process` and :func:`catseye.simulate` compute
on the same engine. Every function takes ``radar`` (a :class:`catseye.Radar`, a preset or the path of a radar file), ``engine`` (a
:class:`catseye.Engine`, opened once by the caller, or the name of a device) and, as further keywords, keys of ``[processing]`` of a radar file that
replace the radar's own, as ``range_window="hamming"`` or ``angle={"method": "music", "sources": 2}``. Arrays may be of any numeric type; they are
converted to the precision of the engine. Values that are not finite, and arrays that do not have the radar's shape, raise :class:`catseye.BadInput`.

>>> import catseye
>>> from catseye import dsp
>>> import numpy as np
>>> radar = catseye.Radar("demo77")
>>> spectrum = dsp.range_doppler(np.ones(radar.shape), radar=radar, engine="cpu")
>>> spectrum.shape
(128, 12, 256)
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _catseye as _c
from ._catseye import BadInput, Engine, Radar, Tracker

__all__ = [
    "KRADAR_AZIMUTH_DEG",
    "KRADAR_ELEVATION_DEG",
    "Found",
    "Masks",
    "Separated",
    "Sparse",
    "Tracker",
    "angle_doppler",
    "angle_spectrum",
    "cfar",
    "chirps_azimuth",
    "cluster",
    "confidence",
    "directions",
    "doppler_transform",
    "grid",
    "masks",
    "object_cells",
    "objects",
    "plots",
    "power",
    "rad",
    "range_azimuth",
    "range_doppler",
    "range_transform",
    "separate",
    "snapshots",
    "sparse",
    "tensor4d",
    "threshold",
]

_Radar: TypeAlias = Radar | str | os.PathLike[str]
_Engine: TypeAlias = Engine | str
_Array: TypeAlias = NDArray[Any]
_Angles: TypeAlias = int | ArrayLike
_Reduce: TypeAlias = Literal["max", "sum", "mean"]

#: Azimuths of the tensors of K-Radar: 107 columns, 1 degree apart.
KRADAR_AZIMUTH_DEG: NDArray[np.float64] = np.arange(-53.0, 54.0)
#: Elevations of the tensors of K-Radar: 37 rows, 1 degree apart.
KRADAR_ELEVATION_DEG: NDArray[np.float64] = np.arange(-18.0, 19.0)


def _changed(radar: _Radar, processing: Mapping[str, Any]) -> Radar:
    radar = radar if isinstance(radar, Radar) else Radar(radar)
    return radar.with_processing(**processing) if processing else radar


def range_transform(
    adc: ArrayLike, *, radar: _Radar, ramp: int = 0, engine: _Engine | None = None, **processing: Any
) -> _Array:
    """The range transform of every chirp, complex [chirp, channel, range] in sqrt(W).

    adc: [chirp, rx_virtual, sample], complex or real. ramp: index of the ramp of a radar with several. Echoes without range rate are removed where
    the radar's settings ask for it (``remove_static``).

    Raises BadInput for a radar with a keystone transform, which precedes the range transform: use :func:`range_doppler`.
    """
    return _c.dsp_range_transform(adc, _changed(radar, processing), ramp, engine)


def doppler_transform(
    range_spectrum: ArrayLike, *, radar: _Radar, ramp: int = 0, engine: _Engine | None = None, **processing: Any
) -> _Array:
    """The Doppler transform of the result of :func:`range_transform`, complex [doppler, channel, range] in sqrt(W), zero Doppler in row M // 2, range
    rate increasing with the row. For a radar with Doppler bands, the bands are further channels, [band, receiver]."""
    return _c.dsp_doppler_transform(range_spectrum, _changed(radar, processing), ramp, engine)


def range_doppler(
    adc: ArrayLike, *, radar: _Radar, ramp: int = 0, engine: _Engine | None = None, **processing: Any
) -> _Array:
    """Range and Doppler transform, complex [doppler, channel, range] in sqrt(W). |X|^2 of a target in the middle of its cell is its received power in
    W, whatever the windows. With a keystone transform, the spectrum is the one of Doppler ambiguity zero."""
    return _c.dsp_range_doppler(adc, _changed(radar, processing), ramp, engine)


def power(
    spectrum: ArrayLike, *, radar: _Radar, ramp: int = 0, engine: _Engine | None = None, **processing: Any
) -> _Array:
    """The power map of a spectrum, [doppler, range] in W: the mean of the power over channels."""
    return _c.dsp_power(spectrum, _changed(radar, processing), ramp, engine)


class Found(NamedTuple):
    """Result of :func:`cfar`: the detected cells of a map."""

    #: Detected cells, bool [doppler, range].
    mask: NDArray[np.bool_]
    #: Doppler row and range column of the peaks among the detected cells, strongest first, int64 [cell, 2].
    cells: NDArray[np.int64]
    #: Mean noise power in each of these cells in W, [cell].
    noise_w: _Array


def _detector(
    kind: str | None,
    rank: int | None,
    guard: Sequence[int] | None,
    train: Sequence[int] | None,
    false_alarm_probability: float | None,
    looks: int | None,
) -> tuple[Any, ...]:
    return (kind, rank, guard, train, false_alarm_probability, looks)


def cfar(
    power: ArrayLike,
    *,
    radar: _Radar | None = None,
    kind: str | None = None,
    rank: int | None = None,
    guard: Sequence[int] | None = None,
    train: Sequence[int] | None = None,
    false_alarm_probability: float | None = None,
    looks: int | None = None,
    engine: _Engine | None = None,
) -> Found:
    """Detects cells of a power map [doppler, range] that exceed the noise around them (CFAR).

    kind: "ca" (mean of the training cells), "go", "so" (greater, smaller mean of their halves) or "os" (the rank-th smallest of them, by default at
    three quarters of their number). rank: of "os" only. guard, train: cells on each side, (doppler, range). false_alarm_probability: for each cell.
    looks: number of independent powers that a cell of the map averages, for a radar its channels. The radar gives the values of the arguments that
    are missing; without a radar, all of them but rank are needed.

    Raises BadInput for a missing argument without a radar, and for a value outside its range.
    """
    settings = _detector(kind, rank, guard, train, false_alarm_probability, looks)
    return Found(*_c.dsp_cfar(power, radar if radar is None else _changed(radar, {}), settings, engine))


def threshold(
    power: ArrayLike,
    *,
    radar: _Radar | None = None,
    kind: str | None = None,
    rank: int | None = None,
    guard: Sequence[int] | None = None,
    train: Sequence[int] | None = None,
    false_alarm_probability: float | None = None,
    looks: int | None = None,
    engine: _Engine | None = None,
) -> _Array:
    """The power in W that each cell must exceed to be detected, [doppler, range]. Arguments as for :func:`cfar`."""
    settings = _detector(kind, rank, guard, train, false_alarm_probability, looks)
    return _c.dsp_threshold(power, radar if radar is None else _changed(radar, {}), settings, engine)


def snapshots(spectrum: _Array, cells: ArrayLike) -> _Array:
    """The snapshots of cells, complex [cell, channel]: all channels of a spectrum [doppler, channel, range] at (row, column) of each of cells [cell,
    2]."""
    at = np.asarray(cells, np.int64).reshape(-1, 2)
    picked: _Array = np.ascontiguousarray(np.asarray(spectrum)[at[:, 0], :, at[:, 1]])
    return picked


class Separated(NamedTuple):
    """Detected cells with separated transmitters: the input of angle estimation in the processing chain."""

    #: Snapshots in sqrt(W), complex128 [cell, virtual channel], channel = transmitter * receivers + receiver, without the phase of motion between transmitters.
    snapshots: NDArray[np.complex128]
    #: Noise power of a virtual channel in W, float64 [cell].
    noise_w: NDArray[np.float64]
    #: Range rate of the peak in m/s, positive receding, float64 [cell]; its Doppler ambiguity is resolved as far as the cell allows.
    range_rate_mps: NDArray[np.float64]
    #: State of the Doppler ambiguity of each cell: "unambiguous", "resolved", "ego_speed", "ambiguous" or "unresolved".
    ambiguity: list[str]
    #: Range of the peak from the middle of the array in m, float64 [cell].
    range_m: NDArray[np.float64]


def separate(
    power: ArrayLike,
    cells: ArrayLike,
    noise_w: ArrayLike,
    snapshots: ArrayLike,
    *,
    radar: _Radar,
    ramp: int = 0,
    velocity_mps: Sequence[float] | None = None,
    **processing: Any,
) -> Separated:
    """Separates the transmitters of detected cells. The phase that a moving body adds between the transmitters is removed, using the range rate of
    the peak and, where the array resolves it, its Doppler ambiguity.

    power, cells, noise_w: from :func:`power` and :func:`cfar`. snapshots: from :func:`snapshots`. velocity_mps: velocity of the radar in its own
    frame, where known. Cells beyond the radar's ``max_points`` are left out. Returns :class:`Separated`.
    """
    changed = _changed(radar, processing)
    return Separated(*_c.dsp_separate(power, cells, noise_w, snapshots, changed, ramp, velocity_mps))


def _angle(processing: dict[str, Any], method: str | None, sources: int | str | None) -> dict[str, Any]:
    named = {key: value for key, value in (("method", method), ("sources", sources)) if value is not None}
    return {**processing, "angle": {**processing.get("angle", {}), **named}} if named else processing


def _looks(array: ArrayLike | None, axes: int) -> _Array | None:
    """The array with the missing leading axes added: one cell and, for snapshots, one snapshot per cell."""
    if array is None:
        return None
    array = np.asarray(array)
    if axes == 3 and array.ndim == 2:
        return array[:, None, :]
    return array[None, None, :] if axes == 3 and array.ndim == 1 else array


def _covariance(array: ArrayLike | None) -> _Array | None:
    array = None if array is None else np.asarray(array)
    return array[None] if array is not None and array.ndim == 2 else array


def directions(
    snapshots: ArrayLike | None = None,
    *,
    radar: _Radar,
    covariance: ArrayLike | None = None,
    noise_w: ArrayLike | None = None,
    method: str | None = None,
    sources: int | str | None = None,
    range_m: ArrayLike | None = None,
    engine: _Engine | None = None,
    **processing: Any,
) -> NDArray[np.void]:
    """Estimates directions of arrival.

    snapshots: complex [virtual channel], [cell, virtual channel] or [cell, snapshot, virtual channel], as :func:`separate` returns them. covariance:
    in place of snapshots, the mean of x x^H over snapshots, [channel, channel] or [cell, channel, channel]. noise_w: [cell], noise power of a
    channel; needed where it determines the number of sources ("residual", the default of all methods except Bartlett's). range_m: [cell], as
    :func:`separate` returns it; with it, angles use the wavelength that a ramp has when it returns from this range, as those of points do; without
    it, the radar's wavelength. method: "bartlett", "capon", "ml", "music", "root-music", "esprit" or "bi-svd", default the radar's. sources: a
    number, "mdl", "aic" or "residual".

    Returns a structured array [source]: cell, azimuth_deg (positive left), elevation_deg (positive up), power_w, azimuth_std_deg, elevation_std_deg
    (NaN for Bartlett's beamformer), ambiguous (another direction has the same response in the array). Sources of a cell follow one another, strongest
    first.
    """
    changed = _changed(radar, _angle(processing, method, sources))
    noise = None if noise_w is None else np.atleast_1d(np.asarray(noise_w))
    ranges = None if range_m is None else np.atleast_1d(np.asarray(range_m, np.float64))
    return _c.dsp_directions(_looks(snapshots, 3), _covariance(covariance), noise, changed, engine, ranges)


def angle_spectrum(
    snapshots: ArrayLike | None = None,
    *,
    radar: _Radar,
    covariance: ArrayLike | None = None,
    noise_w: ArrayLike | None = None,
    method: str | None = None,
    sources: int | str | None = None,
    engine: _Engine | None = None,
    **processing: Any,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """The spectrum over angle of each cell, (values [cell, elevation, azimuth], azimuth_deg, elevation_deg). Arguments as for :func:`directions`.
    Values are in W, except for MUSIC and Bi-SVD: these give numbers from 1 up that are large at a source. ESPRIT and root-MUSIC have no spectrum."""
    changed = _changed(radar, _angle(processing, method, sources))
    noise = None if noise_w is None else np.atleast_1d(np.asarray(noise_w))
    return _c.dsp_angle_spectrum(_looks(snapshots, 3), _covariance(covariance), noise, changed, engine)


def cluster(
    points: Any, *, position_m: float = 1.5, range_rate_mps: float = 1.0, min_points: int = 2
) -> NDArray[np.int64]:
    """Clusters points by density (DBSCAN) and returns the cluster of each point from 0, -1 for none, int64 [point].

    points: structured array or dictionary with the columns x_m, y_m and range_rate_mps, as ``Frame.points``. Two points are neighbours when (dx^2 +
    dy^2) / position_m^2 + drate^2 / range_rate_mps^2 <= 1; a point with min_points neighbours, including itself, is a core.
    """
    return _c.dsp_cluster(points, position_m, range_rate_mps, min_points)


def plots(points: Any, labels: ArrayLike | None = None) -> NDArray[np.void]:
    """One plot (measurement of a tracker) in the plane of the sensor for each cluster of :func:`cluster`, or for each point without labels: a
    structured array with range_m, range_rate_mps, azimuth_deg, their standard deviations and the number of points, the input of :meth:`Tracker.step`.
    points: with the columns of ``Frame.points``."""
    return _c.dsp_plots(points, None if labels is None else [int(i) for i in np.asarray(labels)])


def grid(
    *, radar: _Radar, azimuth: _Angles | None = None, elevation: ArrayLike | None = None, **processing: Any
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The axes of a tensor with these arguments, (azimuth_deg, elevation_deg). azimuth: None for the radar's own beams, a number N for the bins of a
    Fourier transform over a line of antennas spaced by half a wavelength (sin = -1 + 2k/N; the middle bin is straight ahead, later bins are to the
    left), or angles in degrees. elevation: None for the radar's own, or angles in degrees."""
    return _c.dsp_grid(_changed(radar, processing), azimuth, elevation)


def _marginal(
    adc: ArrayLike,
    keep: tuple[bool, bool, bool, bool],
    radar: Radar,
    ramp: int,
    azimuth: _Angles | None,
    elevation: ArrayLike | None,
    reduce: str,
    engine: _Engine | None,
) -> _Array:
    spectrum = _c.dsp_range_doppler(adc, radar, ramp, engine)
    return _c.dsp_tensor(spectrum, radar, keep, reduce, ramp, azimuth, elevation, engine)


def range_azimuth(
    adc: ArrayLike,
    *,
    radar: _Radar,
    ramp: int = 0,
    azimuth: _Angles | None = None,
    elevation: ArrayLike | None = None,
    reduce: _Reduce = "max",
    engine: _Engine | None = None,
    **processing: Any,
) -> _Array:
    """Power over range and azimuth, [range, azimuth] in W. reduce: maximum, sum or mean over Doppler rows and elevations."""
    keep = (False, True, False, True)
    return _marginal(adc, keep, _changed(radar, processing), ramp, azimuth, elevation, reduce, engine)


def angle_doppler(
    adc: ArrayLike,
    *,
    radar: _Radar,
    ramp: int = 0,
    azimuth: _Angles | None = None,
    elevation: ArrayLike | None = None,
    reduce: _Reduce = "max",
    engine: _Engine | None = None,
    **processing: Any,
) -> _Array:
    """Power over azimuth and Doppler, [azimuth, doppler] in W. reduce: maximum, sum or mean over ranges and elevations."""
    keep = (True, False, False, True)
    found = _marginal(adc, keep, _changed(radar, processing), ramp, azimuth, elevation, reduce, engine)
    return np.ascontiguousarray(found.T)


def rad(
    adc: ArrayLike,
    *,
    radar: _Radar,
    ramp: int = 0,
    azimuth: _Angles | None = None,
    elevation: ArrayLike | None = None,
    reduce: _Reduce = "max",
    complex: bool = False,
    engine: _Engine | None = None,
    **processing: Any,
) -> _Array:
    """The cube [range, azimuth, doppler] in the layout of RADDet: power in W, or with complex=True amplitudes in sqrt(W) (of a single elevation).
    reduce: maximum, sum or mean over elevations. With a line of 8 antennas, 256 samples, 64 chirps and azimuth=256, the shape is 256 x 256 x 64."""
    changed = _changed(radar, processing)
    if not complex:
        found = _marginal(adc, (True, True, False, True), changed, ramp, azimuth, elevation, reduce, engine)
        return np.ascontiguousarray(found.transpose(1, 2, 0))
    spectrum = _c.dsp_range_doppler(adc, changed, ramp, engine)
    found = _c.dsp_amplitudes(spectrum, changed, ramp, azimuth, elevation, engine)
    return np.ascontiguousarray(_flat(found).transpose(1, 2, 0))


def _flat(amplitudes: _Array) -> _Array:
    """Amplitudes of one elevation, without that axis."""
    if amplitudes.shape[2] != 1:
        raise _bad("elevation", amplitudes.shape[2], "a cube of amplitudes has a single elevation", "one elevation", "give elevation=[0.0]")
    flat: _Array = amplitudes[:, :, 0, :]
    return flat


def _bad(key: str, value: object, problem: str, allowed: str | None = None, remedy: str | None = None) -> BadInput:
    parts = [f"{key} = {value}: {problem}", *([f"allowed: {allowed}"] if allowed else []), *([remedy] if remedy else [])]
    error = BadInput("; ".join(parts))
    error.file = error.line = None
    error.key, error.value, error.problem, error.allowed, error.remedy = key, str(value), problem, allowed, remedy
    return error


def chirps_azimuth(
    adc: ArrayLike,
    *,
    radar: _Radar,
    chirps: Iterable[int] = (0,),
    ramp: int = 0,
    azimuth: _Angles | None = None,
    elevation: ArrayLike | None = None,
    engine: _Engine | None = None,
    **processing: Any,
) -> _Array:
    """Amplitudes of single chirps over range and azimuth before the Doppler transform, complex [chirp, range, azimuth] in sqrt(W), in the layout of
    RODNet. chirps: indices of loops over the transmitters. The transmitters of a loop are separated under the assumption that all targets are
    static."""
    changed = _changed(radar, processing)
    ranges = _c.dsp_range_transform(adc, changed, ramp, engine)
    wanted = [int(m) for m in chirps]
    if any(m < 0 for m in wanted):
        raise _bad("chirps", wanted, "the frame has no such chirp", f"0 to {ranges.shape[0] - 1}")
    found = _c.dsp_chirp_amplitudes(ranges, changed, wanted, ramp, azimuth, elevation, engine)
    return np.ascontiguousarray(_flat(found))


def tensor4d(
    adc: ArrayLike,
    *,
    radar: _Radar,
    ramp: int = 0,
    azimuth: _Angles | None = None,
    elevation: ArrayLike | None = None,
    engine: _Engine | None = None,
    **processing: Any,
) -> _Array:
    """Power over all four axes, [doppler, range, elevation, azimuth] in W. With ``azimuth=KRADAR_AZIMUTH_DEG, elevation=KRADAR_ELEVATION_DEG``, 64
    chirps and 256 samples, the shape is that of K-Radar, 64 x 256 x 37 x 107."""
    return _marginal(adc, (True,) * 4, _changed(radar, processing), ramp, azimuth, elevation, "max", engine)


class Sparse(NamedTuple):
    """The strongest cells of a tensor, strongest first."""

    #: Index on each axis of the tensor, int64 [cell, axis].
    indices: NDArray[np.int64]
    #: Power in W, [cell].
    power_w: _Array


def sparse(tensor: _Array, *, share: float = 0.1) -> Sparse:
    """The strongest share of a tensor's cells as :class:`Sparse`; the number of cells is rounded up, and among equal cells the first are taken.
    share: above 0, 1 at most."""
    tensor = np.asarray(tensor)
    places = _c.dsp_strongest(tensor.reshape(-1), share)
    indices = np.stack(np.unravel_index(places, tensor.shape), axis=1).astype(np.int64)
    return Sparse(indices, tensor.reshape(-1)[places])


_NUMBERS = (
    ["x_m", "y_m", "z_m", "length_m", "width_m", "height_m"]
    + [f"rotation_{axis}" for axis in "xyzw"]
    + [f"velocity_{axis}_mps" for axis in "xyz"]
    + [f"spin_{axis}_rad_per_s" for axis in "xyz"]
)
_SEEN = ["yaw_deg", "range_m", "range_rate_mps"]
_OBJECT = np.dtype([("id", "u4"), ("class", "U32"), *((name, "f8") for name in _NUMBERS + _SEEN)])


def _columns(boxes: Any) -> dict[str, Any]:
    """Columns of a table of boxes, or of the dictionaries of truth.json."""
    if isinstance(boxes, Mapping):
        return dict(boxes)
    if isinstance(boxes, np.ndarray) and boxes.dtype.names is not None:
        return {name: boxes[name] for name in boxes.dtype.names}
    rows = list(boxes)
    columns: dict[str, Any] = {key: [row[key] for row in rows] for key in ("id", "class", "part")}
    lists = [("centre_m", _NUMBERS[:3]), ("size_m", _NUMBERS[3:6]), ("rotation_xyzw", _NUMBERS[6:10])]
    for key, names in [*lists, ("velocity_mps", _NUMBERS[10:13]), ("spin_rad_per_s", _NUMBERS[13:])]:
        for i, name in enumerate(names):
            columns[name] = [row[key][i] for row in rows]
    return columns


def objects(
    boxes: Any,
    *,
    position_m: ArrayLike,
    rotation_xyzw: ArrayLike,
    velocity_mps: ArrayLike,
    classes: Sequence[str] | None = None,
    visible: bool = True,
) -> NDArray[np.void]:
    """Boxes of the world in the sensor's frame, a structured array [object]: id, class, x_m, y_m, z_m of the middle, length_m, width_m, height_m,
    rotation_x, _y, _z, _w from the object's axes, velocity_x_mps, … relative to the radar, spin_x_rad_per_s, …, yaw_deg, range_m, range_rate_mps.
    Only whole objects are taken, not their parts.

    boxes: table ``boxes`` of a dataset's item, or ``Frame.truth["boxes"]``. position_m, rotation_xyzw, velocity_mps: of the radar in the world, as in
    a frame or a row of the table ``radars``. classes: classes to take, default all. visible: take only the objects that are visible to the radar,
    where the table has this column.
    """
    columns = _columns(boxes)
    wanted = np.asarray(columns["part"], object) == ""
    if classes is not None:
        wanted &= np.isin(np.asarray(columns["class"], str), list(classes))
    if visible and "visible" in columns:
        wanted &= np.asarray(columns["visible"], bool)
    numbers = np.stack([np.asarray(columns[name], float)[wanted] for name in _NUMBERS], axis=1)
    pose = [tuple(np.asarray(v, float).reshape(-1)) for v in (position_m, rotation_xyzw, velocity_mps)]
    seen = _c.dsp_seen(np.zeros(len(numbers), np.int64), numbers, *pose)
    table = np.empty(len(numbers), _OBJECT)
    table["id"], table["class"] = np.asarray(columns["id"])[wanted], np.asarray(columns["class"], str)[wanted]
    for i, name in enumerate(_NUMBERS + _SEEN):
        table[name] = seen[:, i]
    return table


def _bodies(objects: Any, classes: Sequence[str]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Class indices, and rows of numbers, of objects or of points; other classes are left out."""
    if not classes:
        raise _bad("classes", "()", "is empty", None, "give the class names of the labels")
    if not isinstance(objects, np.ndarray) or objects.dtype.names is None or "class" not in objects.dtype.names:
        raise _bad("objects", type(objects).__name__, "is not a table of objects or points", None, "give the result of dsp.objects, or Frame.points")
    names = objects["class"].astype(str)
    wanted = np.isin(names, list(classes))
    if "share" in objects.dtype.names:
        # Points: those that are on their object. Older files do not have all of the flags.
        for flag in ("ghost", "side_lobe", "folded", "aliased"):
            if flag in objects.dtype.names:
                wanted &= ~objects[flag].astype(bool)
        wanted &= objects["object_id"] > 0
    picked = objects[wanted]
    if "length_m" in objects.dtype.names:
        rows = np.stack([picked[name] for name in _NUMBERS], axis=1)
    else:
        place = np.stack([picked[name] for name in ("x_m", "y_m", "z_m")], axis=1)
        rows = np.zeros((len(picked), 16))
        rows[:, :3], rows[:, 9] = place, 1
        # All that is known of a point's velocity is its range rate.
        rows[:, 10:13] = place / np.maximum(picked["range_m"], 1e-9)[:, None] * picked["range_rate_mps"][:, None]
    numbers = np.array([list(classes).index(name) for name in picked["class"].astype(str)], np.int64)
    return numbers, np.ascontiguousarray(rows, float)


class Masks(NamedTuple):
    """Class of each cell, uint8: 1 + its index in ``classes``, 0 where there is no object."""

    #: [range, azimuth].
    range_azimuth: NDArray[np.uint8]
    #: [doppler, range].
    range_doppler: NDArray[np.uint8]
    #: [azimuth, doppler].
    angle_doppler: NDArray[np.uint8]


def masks(
    objects: NDArray[np.void],
    *,
    radar: _Radar,
    classes: Sequence[str],
    ramp: int = 0,
    azimuth: _Angles | None = None,
    **processing: Any,
) -> Masks:
    """Classes of the cells over range and azimuth, Doppler and range, azimuth and Doppler, in the layout of CARRADA: of the cells that the boxes of
    :func:`objects` cover, or of those that contain points (``Frame.points``). Nearer objects hide farther ones. The cells are those of the tensors:
    their range includes the offset due to range rate, and their Doppler is taken modulo the ambiguity interval."""
    numbers, rows = _bodies(objects, classes)
    return Masks(*_c.dsp_masks(numbers, rows, _changed(radar, processing), ramp, azimuth))


def confidence(
    objects: NDArray[np.void],
    *,
    radar: _Radar,
    classes: Sequence[str],
    sigma_m: float | Mapping[str, float] | None = None,
    ramp: int = 0,
    azimuth: _Angles | None = None,
    **processing: Any,
) -> NDArray[np.float32]:
    """Confidence maps in the layout of RODNet, float32 [class, range, azimuth]: for each class the maximum of a Gaussian around each object, 1 in the
    cell of its middle. sigma_m: standard deviation on the ground in m, for all classes or by class; default half the longer side of the object's box,
    0.5 m at minimum. In cells its minimum is 1."""
    numbers, rows = _bodies(objects, classes)
    sigma: NDArray[np.float64] = np.maximum(0.5 * rows[:, 3:5].max(axis=1, initial=0.0), 0.5)
    if isinstance(sigma_m, Mapping):
        sigma = np.array([sigma_m.get(classes[k], s) for k, s in zip(numbers, sigma, strict=True)], float)
    elif sigma_m is not None:
        sigma = np.full(len(numbers), float(sigma_m))
    return _c.dsp_confidence(numbers, rows, len(classes), sigma, _changed(radar, processing), ramp, azimuth)


def object_cells(
    objects: NDArray[np.void],
    *,
    radar: _Radar,
    ramp: int = 0,
    azimuth: _Angles | None = None,
    **processing: Any,
) -> NDArray[np.int64]:
    """Doppler row, range column and azimuth column in the tensors of the middle of each object, int64 [object, 3]; -1 where it is outside."""
    rows = np.stack([objects[name] for name in _NUMBERS], axis=1)
    numbers = np.zeros(len(rows), np.int64)
    return _c.dsp_object_cells(numbers, np.ascontiguousarray(rows, float), _changed(radar, processing), ramp, azimuth)
