"""The tensors of docs/guides/dsp.md in the axes that the loaders of RODNet (CRUW, ROD2021), RADDet, CARRADA and K-Radar read.

Their loaders are not on a package index, so each format is followed here from its public code: the formulas that turn an index into metres, radians
and m/s are those of cruw-devkit, RADDet, carrada_dataset and K-Radar, and a target whose range, azimuth and range rate are known has to lie in the
cell that they say.
"""

import pickle
import re
from pathlib import Path

import numpy as np
import pytest

import catseye
from catseye import dsp

C = 299792458.0
PAGE = Path(__file__).resolve().parents[2] / "docs/guides/dsp.md"


def array(samples, chirps, *, rate_hz=20e6, slope=None, receivers=8):
    """A line of receivers half a wavelength apart, with no windows."""
    text = catseye.Radar("demo77").to_toml()
    place = [(i - (receivers - 1) / 2) * 0.5 * C / 77e9 for i in range(receivers)]
    antennas = "[[tx]]\nposition_m = [0, 0, 0]\n" + "".join(f"[[rx]]\nposition_m = [0, {y}, 0]\n" for y in place)
    text = text[: text.index("[[tx]]")] + antennas + text[text.index("[mounting]") :]

    def change(key, value):
        nonlocal text
        text, count = re.subn(rf"(?m)^{key} = .*$", f"{key} = {value}", text)
        assert count, key

    change("chirps", chirps)
    change("samples", samples)
    change("sample_rate_hz", rate_hz)
    change("range_fft", samples)
    change("doppler_fft", chirps)
    ramp = samples / rate_hz
    change("ramp_time_s", ramp)
    change("chirp_period_s", 1.25 * ramp)
    change("bandwidth_hz", slope * ramp if slope else 375e6)
    return catseye.Radar.parse(text)


def target(radar, column, row, sine):
    """Samples of a target in a range column and a Doppler row, at a sine of the azimuth (positive left)."""
    chirps, _, samples = radar.shape
    place = (radar.tx_position_m[:, None] + radar.rx_position_m).reshape(-1, 3)[:, 1]
    channels = np.exp(-2j * np.pi / radar.wavelength_m * place * sine)
    slow = np.exp(2j * np.pi * np.arange(chirps) * (row - chirps // 2) / chirps)
    fast = np.exp(2j * np.pi * np.arange(samples) * column / samples)
    return slow[:, None, None] * channels[None, :, None] * fast


def top(values):
    return tuple(int(i) for i in np.unravel_index(np.abs(values).argmax(), values.shape))


def rodnet(adc, radar, **options):
    angles = np.degrees(np.arcsin(np.linspace(-1, 1, 128)))
    values = dsp.chirps_azimuth(adc, radar=radar, chirps=[0, 64, 128, 192], azimuth=angles, **options)
    values = values[:, 3:131, ::-1]
    return np.stack([values.real, values.imag], axis=-1).astype(np.float32)


def raddet(adc, radar, **options):
    values = dsp.rad(adc, radar=radar, azimuth=256, complex=True, **options)
    return np.roll(values[::-1, ::-1], 1, axis=1).astype(np.complex64)


CARRADA_AZIMUTH_DEG = (np.arange(256) - 127) * 180 / 256


def carrada(adc, radar, **options):
    power = dsp.power(dsp.range_doppler(adc, radar=radar, **options), radar=radar, **options)
    angles = {"radar": radar, "azimuth": CARRADA_AZIMUTH_DEG, **options}
    return {
        "range_doppler": np.roll(power[::-1].T, 1, axis=1),
        "range_angle": dsp.range_azimuth(adc, **angles)[::-1, ::-1],
        "angle_doppler": np.roll(dsp.angle_doppler(adc, **angles)[::-1, ::-1], 1, axis=1),
    }


def test_rodnet_and_rod2021(engine):
    """`RADAR_RA_H/FRAME_CHIRP.npy`: real and imaginary part over range and azimuth, 128 x 128, with cruw-devkit's grids."""
    radar = array(134, 255, rate_hz=4e6, slope=21.0017e12)
    # confmap2ra: 134 columns, of which three are cut off at each end; angles uniform in the sine.
    range_grid = (np.arange(134) * (4e6 / 134) * C / 21.0017e12 / 2)[3:131]
    angle_grid = np.arcsin(np.linspace(-1, 1, 128))
    np.testing.assert_allclose(np.asarray(radar.range_m)[3:131], range_grid, rtol=1e-9)
    for column, angle in [(40, 90), (100, 20)]:
        # In cruw-devkit x = range sin(angle) points to the right; in catseye azimuths are positive to the left.
        adc = target(radar, column, 127, -np.sin(angle_grid[angle]))
        images = rodnet(adc, radar, engine=engine)
        assert images.shape == (4, 128, 128, 2) and images.dtype == np.float32
        for image in images:
            amplitude = np.sqrt(image[..., 0] ** 2 + image[..., 1] ** 2)
            assert top(amplitude) == (column - 3, angle)
            assert range_grid[top(amplitude)[0]] == pytest.approx(radar.range_m[column])


def test_rodnet_annotations(engine, tmp_path):
    """Lines `frame range angle class` in metres and radians, and confidence maps [class, range, azimuth]."""
    radar = array(134, 255, rate_hz=4e6, slope=21.0017e12)
    boxes = [
        {
            "id": 1, "parent_id": 1, "part": "", "class": "car", "centre_m": [12.0, -5.0, 0.0], "size_m": [4.2, 1.8, 1.5], "rotation_xyzw": [0, 0, 0, 1],
            "velocity_mps": [0, 0, 0], "spin_rad_per_s": [0, 0, 0],
        }
    ]
    pose = {"position_m": [0, 0, 0], "rotation_xyzw": [0, 0, 0, 1], "velocity_mps": [0, 0, 0]}
    seen = dsp.objects(boxes, **pose)
    names = ["pedestrian", "cyclist", "car"]
    lines = [f"{0} {o['range_m']:.4f} {-np.arctan2(o['y_m'], o['x_m']):.4f} {o['class']}" for o in seen]
    frame, distance, angle, name = lines[0].split()
    # read_gt_txt of cruw-devkit; the car stands on the right, where its angles are positive.
    assert int(frame) == 0 and names.index(name) == 2
    assert float(distance) == pytest.approx(13.0) and float(angle) == pytest.approx(np.arctan2(5, 12), abs=1e-4)
    grid = np.degrees(np.arcsin(np.linspace(-1, 1, 128)))
    found = dsp.confidence(seen, radar=radar, classes=names, azimuth=grid)[:, 3:131, ::-1]
    assert found.shape == (3, 128, 128) and not found[:2].any()
    row, column = top(found[2])
    range_grid = np.asarray(radar.range_m)[3:131]
    assert abs(range_grid[row] - 13) <= 0.51 * (range_grid[1] - range_grid[0])
    assert abs(np.linspace(-1, 1, 128)[column] - 5 / 13) <= 0.51 * 2 / 127


def test_raddet(engine):
    """`RAD/part/NUMBER.npy`: complex64 [range, azimuth, doppler], 256 x 256 x 64; the farthest range first, azimuths from left to right."""
    radar = array(256, 64)
    for column, row, azimuth in [(70, 40, 96), (200, 20, 180), (5, 32, 128)]:
        # toCartesianMask: range (255 - i), sine (2 pi j / 256 - pi) / pi, which its picture shows from left to right.
        right = azimuth / 128 - 1
        cube = raddet(target(radar, column, row, -right), radar, engine=engine)
        assert cube.shape == (256, 256, 64) and cube.dtype == np.complex64
        assert top(cube) == (255 - column, azimuth, row)
    # As complexTo2Channels takes it.
    logarithm = np.log10(np.abs(cube) ** 2 + 1.0)
    assert logarithm.dtype == np.float32 and np.isfinite(logarithm).all()


def test_raddet_boxes(engine, tmp_path):
    """`gt/part/NUMBER.pickle`: classes, and boxes [range, azimuth, doppler, and their extents] in cells of the cube."""
    radar = array(256, 64)
    box = {
        "id": 3, "parent_id": 3, "part": "", "class": "car", "centre_m": [20.0, 6.0, 0.0], "size_m": [4.0, 1.8, 1.5], "rotation_xyzw": [0, 0, 0, 1],
        "velocity_mps": [-4.0, 0, 0], "spin_rad_per_s": [0, 0, 0],
    }
    pose = {"position_m": [0, 0, 0], "rotation_xyzw": [0, 0, 0, 1], "velocity_mps": [0, 0, 0]}
    seen = dsp.objects([box], **pose)
    classes, boxes = [], []
    for i in range(len(seen)):
        masks = dsp.masks(seen[i : i + 1], radar=radar, classes=["car"], azimuth=256)
        across = np.roll(masks.range_azimuth[::-1, ::-1], 1, axis=1)
        cells = [*np.nonzero(across), np.nonzero(masks.range_doppler)[0]]
        low, high = (np.array([f(c) for c in cells], float) for f in (np.min, np.max))
        classes.append(str(seen["class"][i]))
        boxes.append([*np.round((low + high) / 2), *np.round(high - low)])
    path = tmp_path / "000000.pickle"
    path.write_bytes(pickle.dumps({"classes": classes, "boxes": np.array(boxes)}))
    read = pickle.loads(path.read_bytes())
    assert read["classes"] == ["car"] and read["boxes"].shape == (1, 6)
    x, y, z, width, height, depth = read["boxes"][0]
    row, column, azimuth = dsp.object_cells(seen, radar=radar, azimuth=256)[0]
    assert abs(x - (255 - column)) <= 2 and abs(y - (256 - azimuth)) <= 3 and abs(z - row) <= 1
    assert 4.0 * 0.8 <= width * radar.range_bin_m <= 4.0 * 1.3 and height > 5 and depth >= 0


def test_carrada(engine):
    """Views of 256 x 64, 256 x 256 and 256 x 64 cells, whose indices AnnotationTransformer of carrada_dataset says."""
    radar = array(256, 64)
    for column, row, degrees in [(70, 40, 18), (200, 20, -30)]:
        # Azimuth in cells of 180/256 degrees to the right of the middle, range rate in rows of the radar.
        right = degrees
        views = carrada(target(radar, column, row, -np.sin(np.radians(right * 180 / 256))), radar, engine=engine)
        shapes = {name: view.shape for name, view in views.items()}
        assert shapes == {"range_doppler": (256, 64), "range_angle": (256, 256), "angle_doppler": (256, 64)}
        closing = -(row - 32)
        # to_rd: range / resolution, and 32 plus the speed in cells, which is positive when the target comes nearer.
        assert top(views["range_doppler"]) == (column, 32 + closing)
        # to_ra: 256 less range / resolution (the first cell past the array is left out), and 128 plus the angle in cells.
        distance, angle = top(views["range_angle"])
        assert distance == 255 - column and abs(angle - (128 + right)) <= 1
        angle, doppler = top(views["angle_doppler"])
        assert abs(angle - (128 + right)) <= 1 and doppler == 32 + closing


def test_carrada_masks(engine):
    """One-hot planes: background, pedestrian, cyclist, car."""
    radar = array(256, 64)
    names = ["pedestrian", "cyclist", "car"]
    box = {
        "id": 3, "parent_id": 3, "part": "", "class": "car", "centre_m": [20.0, -6.0, 0.0], "size_m": [4.0, 1.8, 1.5], "rotation_xyzw": [0, 0, 0, 1],
        "velocity_mps": [-4.0, 0, 0], "spin_rad_per_s": [0, 0, 0],
    }
    pose = {"position_m": [0, 0, 0], "rotation_xyzw": [0, 0, 0, 1], "velocity_mps": [0, 0, 0]}
    seen = dsp.objects([box], **pose)
    masks = dsp.masks(seen, radar=radar, classes=names, azimuth=CARRADA_AZIMUTH_DEG)
    across = np.eye(4)[masks.range_azimuth[::-1, ::-1]].transpose(2, 0, 1)
    doppler = np.eye(4)[np.roll(masks.range_doppler[::-1].T, 1, axis=1)].transpose(2, 0, 1)
    assert across.shape == (4, 256, 256) and doppler.shape == (4, 256, 64)
    assert (across.sum(axis=0) == 1).all() and (doppler.sum(axis=0) == 1).all()
    assert not across[1:3].any() and across[3].any()
    rows, columns = np.nonzero(across[3])
    # It stands on the right, where angles are positive, and comes nearer, where speeds are.
    assert abs(columns.mean() - 128 - np.degrees(np.arctan2(6, 20)) * 256 / 180) < 2
    assert abs(rows.mean() - (255 - seen["range_m"][0] / radar.range_bin_m)) < 3
    rows, columns = np.nonzero(doppler[3])
    assert abs(columns.mean() - 32 - -seen["range_rate_mps"][0] / radar.velocity_bin_mps) < 1
    assert abs(rows.mean() - seen["range_m"][0] / radar.range_bin_m) < 3


def test_kradar(engine):
    """`arrDREA` [doppler, range, elevation, azimuth] of the tesseract, which the loader turns into [doppler, range, azimuth, elevation]."""
    text = array(256, 64).to_toml()
    rows = "".join(f"[[rx]]\nposition_m = [0, {y}, {z}]\n" for y in (0, 0.00195) for z in (0, 0.00195, 0.0039))
    radar = catseye.Radar.parse(text[: text.index("[[rx]]")] + rows + text[text.index("[mounting]") :])
    place = (radar.tx_position_m[:, None] + radar.rx_position_m).reshape(-1, 3)
    azimuth, elevation = np.radians(-20.0), np.radians(9.0)
    look = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    channels = np.exp(-2j * np.pi / radar.wavelength_m * place @ look)
    slow = np.exp(2j * np.pi * np.arange(64) * (20 - 32) / 64)
    adc = slow[:, None, None] * channels[None, :, None] * np.exp(2j * np.pi * np.arange(256) * 40 / 256)
    drea = dsp.tensor4d(adc, radar=radar, azimuth=dsp.KRADAR_AZIMUTH_DEG, elevation=dsp.KRADAR_ELEVATION_DEG, engine=engine)
    assert drea.shape == (64, 256, 37, 107) and drea.dtype == np.float32
    drae = drea.transpose(0, 1, 3, 2)
    doppler, distance, across, up = top(drae)
    assert (doppler, distance) == (20, 40)
    assert (dsp.KRADAR_AZIMUTH_DEG[across], dsp.KRADAR_ELEVATION_DEG[up]) == (-20, 9)


def test_kradar_labels():
    """Lines of `info_label`: half lengths, and the heading in degrees, of boxes with x ahead, y left and z up."""
    turn = np.radians(30.0)
    box = {
        "id": 4, "parent_id": 4, "part": "", "class": "car", "centre_m": [22.0, 3.0, 0.75], "size_m": [4.4, 1.8, 1.5],
        "rotation_xyzw": [0, 0, np.sin(turn / 2), np.cos(turn / 2)], "velocity_mps": [3, 0, 0], "spin_rad_per_s": [0, 0, 0],
    }
    seen = dsp.objects([box], position_m=[2.0, 0, 0.5], rotation_xyzw=[0, 0, 0, 1], velocity_mps=[0, 0, 0])
    names = {"car": "Sedan"}
    lines = [
        f"*, {0}, {o['id']}, {names[o['class']]}, {o['x_m']}, {o['y_m']}, {o['z_m']}, {o['yaw_deg']}, "
        f"{o['length_m'] / 2}, {o['width_m'] / 2}, {o['height_m'] / 2}"
        for o in seen
    ]
    # get_tuple_object of K-Radar's loader takes lines of eleven values.
    values = lines[0].split(",")
    assert len(values) == 11 and values[0] == "*" and values[3][1:] == "Sedan" and int(values[2]) == 4
    x, y, z, heading = (float(v) for v in values[4:8])
    assert (x, y, z) == pytest.approx((20.0, 3.0, 0.25)) and np.radians(heading) == pytest.approx(turn)
    assert [2 * float(v) for v in values[8:]] == pytest.approx([4.4, 1.8, 1.5])


def test_the_page_says_what_is_tested():
    """The expressions of the table in the guide are those above."""
    page = PAGE.read_text()
    for expression in [
        "[:, 3:131, ::-1]",
        "np.roll(x[::-1, ::-1], 1, axis=1)",
        "(np.arange(256) - 127) * 180 / 256",
        "np.roll(power[::-1].T, 1, axis=1)",
        "dsp.KRADAR_AZIMUTH_DEG",
    ]:
        assert expression in page, expression
