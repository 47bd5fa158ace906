"""HTML of objects in notebooks, an image with the main numbers, and pages of ``catseye view``."""

from __future__ import annotations

import base64
import html
import os
import tempfile
import webbrowser
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _catseye
from ._plot import decibel, plot_frame, plot_rcs

if TYPE_CHECKING:
    from ._catseye import RcsResult, Scene

__all__ = ["View", "frame_html", "plot_frame", "plot_rcs", "rcs_html", "scene_html", "view"]

#: Maximum size of a page that is shown in a cell; the notebook stores each of them in its file.
INLINE_BYTES = 24 << 20
#: Maximum number of object names that are listed of a class.
_NAMES = 4


def _table(title: str, rows: Iterable[tuple[str, str]], png: bytes | None, alt: str) -> str:
    """HTML of a title, rows of (name, value) and an image. All text is escaped here and nowhere else."""
    cells = "".join(
        f'<tr><th style="text-align:left;font-weight:normal;opacity:.7;white-space:nowrap">{html.escape(what)}</th>'
        f'<td style="text-align:left">{html.escape(value)}</td></tr>'
        for what, value in rows
    )
    picture = ""
    if png is not None:
        data = base64.b64encode(png).decode("ascii")
        picture = f'<img alt="{html.escape(alt, quote=True)}" style="max-width:480px;width:100%" src="data:image/png;base64,{data}">'
    flex = "display:flex;flex-wrap:wrap;gap:1em;align-items:flex-start"
    return f'<div class="catseye" style="overflow-wrap:anywhere"><b>{html.escape(title)}</b><div style="{flex}">{picture}<table>{cells}</table></div></div>'


def _span(values: Any, unit: str, scale: float = 1.0) -> str:
    """Text of an axis: its single value, or the first, the last and their number."""
    first, last = float(values[0]) * scale, float(values[-1]) * scale
    return f"{first:g} {unit}" if len(values) == 1 else f"{first:g} to {last:g} {unit}, {len(values)} values"


def frame_html(frame: Any) -> str:
    """HTML of a Frame or Detections."""
    power, points = frame.range_doppler, frame.points
    simulated = hasattr(frame, "index")
    title = f"{frame.radar}, frame {frame.index} at {frame.time_s:g} s" if simulated else "Detections"
    rows = []
    if simulated:
        chirps, channels, samples = frame.adc.shape
        rows.append(("samples", f"{chirps} chirps × {channels} channels × {samples}, {frame.adc.dtype}"))
    rows += [
        ("range", _span(frame.range_m, "m")),
        ("range rate", _span(frame.range_rate_mps, "m/s")),
        ("noise", f"{float(np.median(decibel(power))):.1f} dBm a cell (median)"),
    ]
    doppler, cell = np.unravel_index(int(np.argmax(power)), power.shape)
    peak = float(decibel(power[doppler, cell]))
    rows.append(("strongest cell", f"{peak:.1f} dBm at {frame.range_m[cell]:.1f} m, {frame.range_rate_mps[doppler]:.2f} m/s"))
    names = points.dtype.names
    ghosts = int(points["ghost"].sum()) if simulated and "ghost" in names else 0
    rows.append(("points", f"{len(points)}" + (f", {ghosts} of them ghosts" if ghosts else "")))
    if simulated and len(points):
        classes = Counter(str(c) or "of no object" for c in points["class"])
        rows.append(("on", ", ".join(f"{name} {n}" for name, n in classes.most_common(6))))
    flat = np.ascontiguousarray(power, np.float32).ravel()
    marks = np.column_stack([points["range_m"], points["range_rate_mps"]]).astype(float).tolist()
    # The image has no room for a long name; the table beside it has.
    png = _catseye.picture_map("range-Doppler map", flat, frame.range_m.tolist(), frame.range_rate_mps.tolist(), marks)
    return _table(title, rows, png, "Range-Doppler map with its points")


def scene_html(scene: Scene) -> str:
    """HTML of a Scene."""
    rows = [("objects", f"{len(scene)}"), ("triangles", f"{scene.triangle_count}")]
    bounds = scene.bounds_m()
    if bounds is not None:
        size = " × ".join(f"{extent:.3g}" for extent in np.ptp(bounds, axis=0))
        rows.append(("size", f"{size} m (x forward, y left, z up)"))
    named: dict[str, list[str]] = {}
    for o in scene.objects:
        named.setdefault(o["class"] or "of no class", []).append(o["name"])
    for class_, names in sorted(named.items(), key=lambda item: -len(item[1]))[:12]:
        told = list(dict.fromkeys(name for name in names if name))
        few = ", ".join(told[:_NAMES]) + (", …" if len(told) > _NAMES else "")
        rows.append((class_, f"{len(names)}" + (f" ({few})" if few else "")))
    if scene.materials:
        rows.append(("materials", ", ".join(scene.materials[:8]) + (", …" if len(scene.materials) > 8 else "")))
    png = _catseye.picture_scene(scene) if len(scene) else None
    return _table(scene.name or "Scene", rows, png, "The scene from above" if len(scene) > 1 else "The body with its dimensions")


def rcs_html(result: RcsResult) -> str:
    """HTML of an RcsResult."""
    rows = [
        ("frequency", _span(result.frequency_hz, "GHz", 1e-9)),
        ("azimuth", _span(result.azimuth_deg, "deg")),
        ("elevation", _span(result.elevation_deg, "deg")),
    ]
    receivers = [("receiver's azimuth", result.bistatic_azimuth_deg), ("receiver's elevation", result.bistatic_elevation_deg)]
    rows += [(what, _span(axis, "deg")) for what, axis in receivers if axis is not None]
    for name in ("vv", "hh"):
        levels = getattr(result, f"{name}_dbsm")
        f, el, az = np.unravel_index(int(np.argmax(levels)), levels.shape)[:3]
        where = f"azimuth {result.azimuth_deg[az]:g}°, elevation {result.elevation_deg[el]:g}°"
        if len(result.frequency_hz) > 1:
            where += f", {result.frequency_hz[f] * 1e-9:g} GHz"
        rows.append((f"largest {name.upper()}", f"{levels.max():.2f} dBsm at {where}"))
    rows.append(("bounces that radiate", result.convention))
    if result.convergence_db is not None:
        rows.append(("change against a finer run", f"{result.convergence_db:.2g} dB"))
    rows += [("warning", line) for line in result.warnings]
    png = None
    try:
        png = _catseye.picture_rcs(result)
    except _catseye.BadInput:
        # A single direction has no curve, and directions of both transmitter and receiver have no image: only the numbers are shown.
        pass
    return _table(result.target, rows, png, "Cross section over what varies")


class View:
    """A page that :func:`view` wrote. A notebook shows it in the cell; :meth:`open` shows it in the browser.

    path: the HTML file. bytes: its size. frames: number of frames in it. beside: folder with the frames that do not fit into the file, else None.
    height_px: height of the page in a notebook's cell; may be changed.
    """

    def __init__(self, path: Path, *, bytes: int, frames: int, beside: Path | None = None, height_px: int = 640) -> None:
        self.path = path
        self.bytes = bytes
        self.frames = frames
        self.beside = beside
        self.height_px = height_px

    def open(self) -> None:
        """Shows the page in the browser. Raises Failed where no browser opens it; the page is at ``path``."""
        if not webbrowser.open(self.path.absolute().as_uri()):
            raise _catseye.Failed(f"the page is written, but no browser opened it: {self.path}")

    def _repr_html_(self) -> str:
        if self.beside is not None or self.bytes > INLINE_BYTES:
            size = f"{self.bytes / (1 << 20):.1f} MiB" + (f" and {self.frames} frames beside it" if self.beside else "")
            where = html.escape(str(self.path))
            return f"<div>The page ({html.escape(size)}) is too long for a cell. It lies at <code>{where}</code>; <code>.open()</code> shows it in the browser.</div>"
        page = html.escape(self.path.read_text(encoding="utf-8"), quote=True)
        # Scripts of the page reach nothing of the notebook: a sandbox without the same origin.
        return (
            f'<iframe title="catseye view" sandbox="allow-scripts allow-downloads" style="width:100%;height:{int(self.height_px)}px;border:1px solid #8884" '
            f'srcdoc="{page}"></iframe>'
        )

    def __repr__(self) -> str:
        return f"<catseye.View {self.path}: {self.bytes / (1 << 20):.1f} MiB, {self.frames} frames>"


def view(
    thing: Scene | RcsResult | str | os.PathLike[str] | Sequence[Scene | RcsResult] | Sequence[str | os.PathLike[str]],
    *,
    output: str | os.PathLike[str] | None = None,
    force: bool = False,
    progress: Callable[[int, int], object] | None = None,
) -> View:
    """Writes the page of ``catseye view``, one HTML file that needs no network, and returns it as a View. A notebook shows the View in the cell; its
    ``open()`` shows it in the browser.

    thing: folder of a run, of one of its frames or of a dataset, a scene (.glb, .gltf, .stl, .obj), a reflector ("type1:width_m=0.16"), a table of
    cross sections (.csv), a Scene or an RcsResult. Several tables or results in a list are drawn over each other; a scene before them is their
    target, and the page turns it to the direction at which they are read. output: the file to write, default page.html in a new temporary folder,
    which is not deleted. force: replace an existing file. progress: called with the number of frames done and the total.

    Raises BadInput for a thing that a page cannot show, and for a file that exists.
    """
    if output is None:
        output = Path(tempfile.mkdtemp(prefix="catseye-view-")) / "page.html"
    made = _catseye.write_page(thing, os.fspath(output), force, progress)
    beside = None if made["beside"] is None else Path(made["beside"])
    return View(Path(made["page"]), bytes=made["bytes"], frames=made["frames"], beside=beside)
