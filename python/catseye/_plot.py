"""Plots with matplotlib, which is imported only when a plot is drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import dsp

_Floats = NDArray[np.float64]

#: The kinds of plots of a frame.
KINDS = ("range_doppler", "birds_eye")
#: Classes of the ground, whose outlines would only frame the plot.
_GROUND = frozenset({"road", "verge", "ground", "terrain", "lane_line"})
#: Maximum number of curves in one plot.
_MOST_CURVES = 10
#: Span of the RCS axis below the maximum of a cut; lower values are cross-polarisation that symmetry forbids.
_SPAN_DB = 60.0


def _pyplot() -> Any:
    try:
        import matplotlib.pyplot as plt
    except ImportError as e:
        raise ImportError("plots need matplotlib, which catseye does not install: pip install matplotlib") from e
    return plt


def _axes(ax: Any, **subplot: Any) -> Any:
    """The Axes to draw into: the given ones, or those of a new figure."""
    plt = _pyplot()
    if ax is not None:
        return ax
    _, made = plt.subplots(layout="constrained", subplot_kw=subplot or None)
    return made


def _plain(text: str) -> str:
    """The text with dollar signs escaped: matplotlib takes text between dollar signs for a formula."""
    return text.replace("$", r"\$")


def _short(text: str, most: int = 60) -> str:
    """The text, cut to a length that fits over a plot: the name of a reflector contains every parameter."""
    return _plain(text if len(text) <= most else text[: most - 1] + "…")


def _check_kind(kind: str) -> None:
    if kind not in KINDS:
        raise dsp._bad("kind", kind, "there is no such plot of a frame", ", ".join(KINDS))


def decibel(power: Any) -> _Floats:
    """Powers in W as dBm; -inf for power 0."""
    with np.errstate(divide="ignore"):
        levels: _Floats = 10 * np.log10(np.asarray(power, np.float64)) + 30
    return levels


def folded(range_rate_mps: Any, axis_mps: Any) -> _Floats:
    """Range rates modulo the span of the map's Doppler axis, which is ambiguous by multiples of its span."""
    rate, axis = np.asarray(range_rate_mps, np.float64), np.asarray(axis_mps, np.float64)
    if len(axis) < 2:
        return rate
    step = axis[1] - axis[0]
    lowest, span = axis[0] - step / 2, step * len(axis)
    turns = np.floor((rate - lowest) / span)
    # After rounding, a rate at the edge may be on either side.
    within = (rate >= lowest - 1e-6 * span) & (rate <= lowest + span * (1 + 1e-6))
    out: _Floats = np.where(within, rate, rate - span * turns)
    return out


def _draw_map(ax: Any, power_w: Any, range_m: Any, range_rate_mps: Any, points: Any, title: str, colorbar: bool) -> Any:
    levels = decibel(power_w)
    finite = levels[np.isfinite(levels)]
    # From just under the noise, which fills most of a map, as in the images of `catseye simulate`.
    top = float(finite.max()) if finite.size else 0.0
    bottom = max(float(np.median(finite)) - 2, top - 90) if finite.size else -1.0
    half = [float(a[1] - a[0]) / 2 if len(a) > 1 else 0.5 for a in (range_m, range_rate_mps)]
    extent = (range_m[0] - half[0], range_m[-1] + half[0], range_rate_mps[0] - half[1], range_rate_mps[-1] + half[1])
    image = ax.imshow(
        np.maximum(levels, bottom), origin="lower", aspect="auto", extent=extent, interpolation="nearest", cmap="viridis", vmin=bottom, vmax=max(top, bottom + 1)
    )
    if points is not None and len(points):
        rates = folded(points["range_rate_mps"], range_rate_mps)
        ax.scatter(points["range_m"], rates, s=36, facecolors="none", edgecolors="white", linewidths=1.2, label=f"points ({len(points)})")
        # A point outside the map does not enlarge the axes.
        ax.set_xlim(extent[:2])
        ax.set_ylim(extent[2:])
    ax.set_xlabel("range (m)")
    ax.set_ylabel("range rate (m/s)")
    if colorbar:
        ax.figure.colorbar(image, ax=ax, label="power (dBm)")
    if title:
        ax.set_title(_plain(title))
    return ax


def _rotation(xyzw: Any) -> _Floats:
    """Matrices [..., 3, 3] of unit quaternions [..., 4]."""
    x, y, z, w = np.moveaxis(np.asarray(xyzw, np.float64), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    out: _Floats = np.moveaxis(np.array(rows), (0, 1), (-2, -1))
    return out


def footprints(centre_m: Any, size_m: Any, rotation_xyzw: Any, position_m: Any, radar_xyzw: Any) -> _Floats:
    """The lower corners of boxes of the world in the frame of a radar, x forward and y left, in m: float64 [box, 4, 2]."""
    signs = np.array([[1, 1, -1], [-1, 1, -1], [-1, -1, -1], [1, -1, -1]]) / 2
    local = signs[None] * np.asarray(size_m, np.float64)[:, None]
    world = np.einsum("bij,bcj->bci", _rotation(rotation_xyzw), local) + np.asarray(centre_m, np.float64)[:, None]
    out: _Floats = ((world - np.asarray(position_m, np.float64)) @ _rotation(radar_xyzw))[..., :2]
    return out


def _draw_birds_eye(ax: Any, points: Any, boxes: Any, classes: Sequence[str], range_m: Any, title: str, colorbar: bool) -> Any:
    from matplotlib.patches import Polygon

    reach = [1.0]
    for corners, name in zip(boxes, classes):
        middle = corners.mean(axis=0)
        if name in _GROUND or np.hypot(*middle) > range_m[-1] or middle[0] < 0:
            continue
        reach.append(float(np.hypot(*middle)))
        if np.ptp(corners, axis=0).max() < 1e-9:
            ax.plot(*middle[::-1], marker="D", color="0.5", markersize=5, linestyle="none")
        else:
            ax.add_patch(Polygon(corners[:, ::-1], closed=True, facecolor="0.85", edgecolor="0.45", linewidth=0.8))
    x, y = [0.0], [0.0]
    if points is not None and len(points):
        x, y = points["x_m"], points["y_m"]
        rate = points["range_rate_mps"]
        drawn = ax.scatter(y, x, c=rate, cmap="cividis", s=22, edgecolors="black", linewidths=0.4, zorder=3, label=f"points ({len(points)})")
        if colorbar:
            ax.figure.colorbar(drawn, ax=ax, label="range rate (m/s)")
    ax.plot(0, 0, marker="^", color="black", markersize=7, linestyle="none", label="radar", zorder=4)
    known = np.isfinite(np.asarray(y, np.float64))
    far = min(max(max(reach), float(np.max(np.asarray(x)[known], initial=1.0))) * 1.08, float(range_m[-1]))
    wide = max(float(np.max(np.abs(np.asarray(y)[known]), initial=0.0)) * 1.1, far / 4)
    ax.set_aspect("equal")
    # The left side of the radar is on the left of the plot.
    ax.set_xlim(wide, -wide)
    ax.set_ylim(-0.04 * far, far)
    ax.set_xlabel("y left (m)")
    ax.set_ylabel("x forward (m)")
    if title:
        ax.set_title(_plain(title))
    return ax


def plot_frame(frame: Any, kind: str = "range_doppler", points: bool = True, ax: Any = None) -> Any:
    """Draws a Frame or Detections; see ``Frame.plot``."""
    _check_kind(kind)
    ax = _axes(ax)
    title = f"{frame.radar}, frame {frame.index}" if hasattr(frame, "index") else ""
    found = frame.points if points else None
    if kind == "range_doppler":
        return _draw_map(ax, frame.range_doppler, frame.range_m, frame.range_rate_mps, found, title, True)
    boxes: Any = []
    classes: list[str] = []
    if hasattr(frame, "truth"):
        told = [b for b in frame.truth["boxes"] if not b.get("part")]
        if told:
            centre, size, rotation = ([b[key] for b in told] for key in ("centre_m", "size_m", "rotation_xyzw"))
            boxes = footprints(centre, size, rotation, frame.position_m, frame.rotation_xyzw)
            classes = [b["class"] for b in told]
    return _draw_birds_eye(ax, found, boxes, classes, frame.range_m, title, True)


def plot_sample(
    sample: Mapping[str, Any], arrays: Sequence[str], kind: str, radar: str | None, points: bool, colorbar: bool, ax: Any
) -> Any:
    """Draws a frame of a dataset with its tables ``radars``, ``points`` and ``boxes`` where they are stored; see ``Dataset.plot``."""
    rows = sample["radars"]
    names = [str(name) for name in rows["radar"]]
    if radar is None:
        radar = names[0]
    if radar not in names:
        raise dsp._bad("radar", radar, "the dataset has no such radar", ", ".join(names))
    row = rows[names.index(radar)]
    several = "range_doppler_" + radar.lower().replace("-", "_")
    name = several if several in arrays else "range_doppler"
    found = None
    if points and "points" in sample:
        found = sample["points"][sample["points"]["radar"].astype(str) == radar]
    title = f"frame {sample['frame']}" + (f", {radar}" if len(names) > 1 else "")
    if kind == "range_doppler":
        if name not in sample:
            raise dsp._bad("kind", kind, "the dataset contains no maps", None, "make it again with range_doppler = true in [keep] of its recipe")
        power = sample[name]
        range_rate = row["first_range_rate_mps"] + row["range_rate_bin_mps"] * np.arange(power.shape[-2])
        range_m = row["first_range_m"] + row["range_bin_m"] * np.arange(power.shape[-1])
        return _draw_map(_axes(ax), power, range_m, range_rate, found, title, colorbar)
    if found is None and "boxes" not in sample:
        raise dsp._bad("kind", kind, "the dataset contains neither points nor truth", None, "make it again with points = true in [keep] of its recipe")
    bins = sample[name].shape[-1] if name in sample else 0
    # Without a map, the maximum range is unknown.
    range_m = np.array([row["first_range_m"] + row["range_bin_m"] * (bins - 1) if bins else np.inf])
    boxes: Any = []
    classes: list[str] = []
    if "boxes" in sample:
        told = sample["boxes"][sample["boxes"]["part"].astype(str) == ""]
        columns = [("x_m", "y_m", "z_m"), ("length_m", "width_m", "height_m"), tuple(f"rotation_{axis}" for axis in "xyzw")]
        if len(told):
            centre, size, rotation = (np.stack([told[c] for c in group], axis=-1) for group in columns)
            boxes = footprints(centre, size, rotation, [row[c] for c in columns[0]], [row[c] for c in columns[2]])
            classes = [str(c) for c in told["class"]]
    return _draw_birds_eye(_axes(ax), found, boxes, classes, range_m, title, colorbar)


#: Axes of a table of cross sections in their order: name, and label of the axis of a plot.
_RCS_AXES = {
    "frequency_hz": "frequency (GHz)",
    "elevation_deg": "elevation (deg), positive up",
    "azimuth_deg": "azimuth (deg), positive left",
    "bistatic_elevation_deg": "receiver's elevation (deg), positive up",
    "bistatic_azimuth_deg": "receiver's azimuth (deg), positive left",
}


#: The entry of S of the polarisations derived from V and H, as (pair, received, transmitted).
_DERIVED = {
    **{f"{p}{q}": ("circular", i, j) for i, p in enumerate("rl") for j, q in enumerate("rl")},
    **{f"{p}{q}": ("linear45", i, j) for i, p in enumerate(("p45", "m45")) for j, q in enumerate(("p45", "m45"))},
}


def _levels(result: Any, polarisation: str) -> _Floats:
    """Cross sections in dBsm in the shape of the table's axes."""
    if polarisation not in _DERIVED:
        own: _Floats = getattr(result, f"{polarisation}_dbsm")
        return own
    pair, rx, tx = _DERIVED[polarisation]
    with np.errstate(divide="ignore"):
        levels: _Floats = 10 * np.log10(4 * np.pi * np.abs(result.in_polarisation(pair)[..., rx, tx]) ** 2)
    return levels


def plot_rcs(
    result: Any, polarisation: Any = None, over: str | None = None, at: Mapping[str, float] | None = None, polar: bool = False, ax: Any = None
) -> Any:
    """Draws a cut through an RcsResult; see ``RcsResult.plot``."""
    axes = {name: np.asarray(getattr(result, name)) for name in _RCS_AXES if getattr(result, name) is not None}
    wanted = ["vv"] if polarisation is None else [polarisation] if isinstance(polarisation, str) else list(polarisation)
    pairs = {pair: [name for name, entry in _DERIVED.items() if entry[0] == pair] for pair in ("circular", "linear45")}
    wanted = [name for one in wanted for name in pairs.get(one, [one])]
    known = ["vv", "vh", "hv", "hh", *_DERIVED]
    for one in wanted:
        if one not in known:
            raise dsp._bad("polarisation", one, "there is no such polarisation", ", ".join([*known, *pairs]))
    if over is None:
        # The first of the longest, an angle before the frequency.
        over = max(sorted(axes, key=lambda name: name == "frequency_hz"), key=lambda name: len(axes[name]))
    names = list(axes)
    if over not in axes:
        raise dsp._bad("over", over, "the table has no such axis", ", ".join(names))
    if polar and over == "frequency_hz":
        raise dsp._bad("polar", True, "a disc shows an angle, and this cut runs over the frequency", None, "give over= an angle")
    index: list[Any] = [slice(None)] * len(axes)
    for name, value in (at or {}).items():
        if name not in axes or name == over:
            raise dsp._bad("at", name, "is not an axis across the cut", ", ".join(n for n in names if n != over))
        near = int(np.argmin(np.abs(axes[name] - value)))
        if not np.isclose(axes[name][near], value, rtol=1e-9, atol=1e-9):
            raise dsp._bad(f"at.{name}", value, "the table has no such value", ", ".join(f"{v:g}" for v in axes[name][:20]))
        index[names.index(name)] = slice(near, near + 1)
    across = [name for name in names if name != over]
    kept = {name: axes[name][index[names.index(name)]] for name in across}
    curves = int(np.prod([len(v) for v in kept.values()])) * len(wanted)
    if curves > _MOST_CURVES:
        remedy = "choose with at=, as at={" + ", ".join(f'"{n}": {v[0]:g}' for n, v in kept.items() if len(v) > 1) + "}"
        raise dsp._bad("at", at, f"the cut has {curves} curves", f"up to {_MOST_CURVES}", remedy)
    ax = _axes(ax, **({"projection": "polar"} if polar else {}))
    if polar and ax.name != "polar":
        raise dsp._bad("ax", ax.name, "are not polar Axes", None, 'make them with subplot_kw={"projection": "polar"}')
    scale = 1e-9 if over == "frequency_hz" else 1.0
    # Curves differ in brightness and dashes too, so that they can be distinguished without colours.
    viridis = _pyplot().get_cmap("viridis")
    dashes = ["-", "--", "-.", ":"]
    top = -np.inf
    number = 0
    for one in wanted:
        levels = np.moveaxis(_levels(result, one)[tuple(index)], names.index(over), -1)
        for place in np.ndindex(*levels.shape[:-1]):
            values = [(name, kept[name][i]) for name, i in zip(across, place) if len(kept[name]) > 1]
            words = [one.upper()] if len(wanted) > 1 or not values else []
            words += [f"{v * 1e-9:g} GHz" if name == "frequency_hz" else f"{name.removesuffix('_deg').replace('_', ' ')} {v:g}°" for name, v in values]
            x = axes[over] * (np.pi / 180 if polar else scale)
            style = {"color": viridis(0.85 * number / max(curves - 1, 1)), "linestyle": dashes[number % len(dashes)]}
            # An amplitude of zero becomes a very small value, not a gap.
            y = np.maximum(levels[place], -400.0)
            ax.plot(x, y, label=", ".join(words), marker="o" if len(x) == 1 else None, **style)
            top = max(top, float(y.max()))
            number += 1
    lowest = max(min(float(line.get_ydata().min()) for line in ax.get_lines()), top - _SPAN_DB)
    if polar:
        ax.set_theta_zero_location("N")
        ax.set_theta_direction(1)
        ax.set_rlim(min(lowest, top - 3), top + 1)
        angles = np.arange(0, 360, 45)
        ax.set_thetagrids(angles, [f"{(a + 180) % 360 - 180}°" for a in angles])
        ax.set_title(f"{_short(result.target)}\nRCS (dBsm) over {_RCS_AXES[over]}")
    else:
        ax.set_ylim(min(lowest, top - 3) - 1, top + 2)
        ax.set_xlabel(_RCS_AXES[over])
        ax.set_ylabel("RCS (dBsm)")
        ax.grid(True, alpha=0.3)
        ax.set_title(_short(result.target))
    if number > 1 or len(wanted) > 1:
        ax.legend()
    return ax
