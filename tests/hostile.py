#!/usr/bin/env python3
"""Hostile use of the program: some thousand runs with broken files, absurd values, outputs that would lose something, kills,
writers at the same time and limits of the system.

    tests/hostile.py [PROGRAM] [--only WORDS] [--list] [--jobs N]

PROGRAM is target/release/catseye unless given. Every run must end by itself in time and bounded memory, with 0, 1 or 2, without
the words of a panic; where it ends with 2 there is one line of error of at most 300 characters (names of files not counted) in
which no type of Rust is named; an error leaves nothing behind, and inputs stay as they were. What a case asks beyond that stands
in its table below. Only Python's standard library is used.
"""
import argparse
import collections
import concurrent.futures
import json
import math
import os
import random
import re
import resource
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import zlib
from pathlib import Path

TREE = Path(__file__).resolve().parent.parent
SECONDS = 20  # of one run, on a machine that does other things as well
RUST = re.compile(r"\b(usize|isize|[iu](8|16|32|64)|f(32|64)|Vec<|Option<|Some\(|None\b|Ok\(|Err\(|unwrap|panicked|RUST_BACKTRACE|\.rs:\d+)")

RADAR = """
name = "small"
[waveform]
kind = "fmcw"
carrier_hz = 77e9
bandwidth_hz = 375e6
ramp_time_s = 12.8e-6
chirp_period_s = 16e-6
chirps = 16
multiplex = "tdm"
[receiver]
sampling = "iq"
sample_rate_hz = 20e6
samples = 64
adc_start_s = 0
noise_figure_db = 13
thermal_noise = true
[transmitter]
power_dbm = 12
[antenna]
polarisation = "V"
gain_dbi = 12
pattern = "cosine-power"
azimuth_exponent = 1.6
elevation_exponent = 36
[[tx]]
position_half_wavelengths = [0, 0, 0]
[[rx]]
position_half_wavelengths = [0, -0.5, 0]
[[rx]]
position_half_wavelengths = [0, 0.5, 0]
[mounting]
position_m = [3.6, 0, 0.5]
yaw_deg = 0
pitch_deg = 0
roll_deg = 0
[processing]
range_window = { kind = "hann" }
doppler_window = { kind = "dolph-chebyshev", side_lobe_db = 60 }
range_fft = 64
doppler_fft = 16
remove_static = false
range_migration = "none"
group_range_cells = 0
azimuth_bins = 16
azimuth_max_deg = 60
elevation_bins = 1
max_points = 64
[processing.angle]
method = "bartlett"
[processing.cfar]
kind = "ca"
guard_range_cells = 1
guard_doppler_cells = 1
train_range_cells = 4
train_doppler_cells = 2
false_alarm_probability = 1e-4
"""

SCENARIO = """
name = "s"
seed = 1
radar = "radar.toml"
mutual_interference = false
[scene]
builtin = "empty"
[[point]]
name = "corner"
class = "reflector"
position_m = [15, 1, 0.5]
velocity_mps = [0, 0, 0]
rcs_dbsm = 10
[[object]]
name = "marker"
reflector = "plate:width_m=0.1,height_m=0.1"
position_m = [12, 0, 0.5]
yaw_deg = 180
pitch_deg = 0
roll_deg = 0
velocity_mps = [0, 0, 0]
[weather]
rain_mm_per_h = 0
temperature_c = 20
[ego]
position_m = [0, 0, 0]
yaw_deg = 0
speed_mps = 1
[frames]
count = 1
interval_s = 0.05
[trace]
bounces = 2
accuracy_db = 0.2
rays = 100
convention = "every"
[output]
adc = true
range_doppler = true
points = true
returns = true
truth = true
masks = false
plots = false
"""

ROAD = """
name = "r"
sagitta_m = 0.02
[[road]]
name = "main"
start = { position_m = [0, 0, 0], heading_deg = 0 }
plan = [{ kind = "straight", length_m = 20 }, { kind = "arc", length_m = 20, radius_m = 100 }]
grade_percent = 1
surface = "asphalt"
centre_line = "dashed"
paint = { width_m = 0.15, dash_m = 4, gap_m = 8, thickness_m = 0.0015 }
left = [{ width_m = 3.25, line = "solid" }]
right = [{ width_m = 3.25, line = "dashed" }]
[[road.rail]]
lateral = { edge = "left", offset_m = 1 }
from_m = 1
to_m = 30
post_spacing_m = 4
[[road.markers]]
name = "row"
reflector = "type1:width_m=0.16,height_m=0.004,material=aluminium"
lateral = { lane = 1, side = "right", offset_m = 0.1 }
from_m = 3
spacing_m = 5
count = 3
turn_deg = 15
[[road.vehicle]]
kind = "passenger-car"
s_m = 20
lateral = { lane = 1, offset_m = 0 }
speed_mps = 5
heading_deg = 2
"""

RECIPE = """
name = "tiny"
seed = 3
scenes = 2
frames_per_scene = 1
[split]
train = [0]
validation = [1]
test = []
[store]
format = "frames"
frames_per_shard = 2
[keep]
adc = false
returns = true
[[scenario.point]]
position_m = [{ uniform = [8, 20] }, { normal = [0, 1], limits = [-3, 3] }, 0.5]
rcs_dbsm = { uniform = [0, 10] }
[scenario]
radar = "radar.toml"
[scenario.scene]
builtin = "empty"
[scenario.ego]
speed_mps = { choice = [1, 2] }
[scenario.frames]
interval_s = 0.1
[scenario.trace]
rays = 100
"""

STUDY = """
name = "st"
title = "t"
reference = ""
note = ""
quantities = ["rcs_dbsm"]
[set]
elevation_deg = 5
frequency_hz = 77e9
polarisation = "vv"
snr_db = 10
target = "plate:width_m=0.1,height_m=0.1"
[[sweep]]
parameter = "azimuth_deg"
start = 0
stop = 2
step = 1
[solver]
bounces = 2
accuracy_db = 0.1
convention = "every"
diffraction = "none"
"""

XODR = """<?xml version="1.0"?>
<OpenDRIVE><header revMajor="1" revMinor="6"/>
<road id="1" length="40" junction="-1"><planView>
<geometry s="0" x="0" y="0" hdg="0" length="20"><line/></geometry>
<geometry s="20" x="20" y="0" hdg="0" length="20"><arc curvature="0.01"/></geometry>
</planView><elevationProfile><elevation s="0" a="0" b="0.01" c="0" d="0"/></elevationProfile>
<lanes><laneOffset s="0" a="0" b="0" c="0" d="0"/><laneSection s="0"><left><lane id="1" type="driving">
<width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></left><center><lane id="0" type="none">
<roadMark sOffset="0" type="broken" width="0.12"/></lane></center><right><lane id="-1" type="driving">
<width sOffset="0" a="3.5" b="0" c="0" d="0"/><roadMark sOffset="0" type="solid" width="0.12"/></lane></right></laneSection></lanes>
</road></OpenDRIVE>
"""

TI_CFG = """sensorStop
flushCfg
dfeDataOutputMode 1
channelCfg 15 1 0
adcCfg 2 1
adcbufCfg -1 0 1 1 1
profileCfg 0 77 429 7 57.14 0 0 70 1 64 5209 0 0 30
chirpCfg 0 0 0 0 0 0 0 1
frameCfg 0 0 16 1 100 1 0
lowPower 0 0
lvdsStreamCfg -1 0 1 0
sensorStart
"""

# --------------------------------------------------------------------------------------------------------------------


def npy(shape=(16, 2, 64), descr="<c8", order="False", data=None, version=b"\x01\x00"):
    header = "{'descr': '%s', 'fortran_order': %s, 'shape': %s, }" % (descr, order, shape)
    size = 2 if version[0] == 1 else 4
    pad = -(8 + size + len(header) + 1) % 64
    header = (header + " " * pad + "\n").encode()
    count = 1
    for n in shape:
        count *= n
    if data is None:
        data = b"".join(struct.pack("<2f", 1e-7 * (i % 7), 1e-7 * (i % 5)) for i in range(count))
    return b"\x93NUMPY" + version + len(header).to_bytes(size, "little") + header + data


def glb(change=None, positions=((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)), indices=(0, 1, 2, 0, 2, 3)):
    points = b"".join(struct.pack("<3f", *p) for p in positions)
    faces = b"".join(struct.pack("<I", i) for i in indices)
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "sheet"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{"name": "steel"}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(positions), "type": "VEC3",
             "min": [min(p[k] for p in positions) for k in range(3)], "max": [max(p[k] for p in positions) for k in range(3)]},
            {"bufferView": 1, "componentType": 5125, "count": len(indices), "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(points)},
            {"buffer": 0, "byteOffset": len(points), "byteLength": len(faces)},
        ],
        "buffers": [{"byteLength": len(points) + len(faces)}],
    }
    if change:
        change(tree)
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    binary = points + faces
    whole = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<III", 0x46546C67, 2, 12 + len(whole)) + whole


STL = ("solid s\n" + "".join(
    "facet normal 1 0 0\nouter loop\nvertex 0 0 0\nvertex 0 %s 0\nvertex 0 0 %s\nendloop\nendfacet\n" % (a, a) for a in (1, 2)
) + "endsolid s\n").encode()
STL_BINARY = b"\0" * 80 + struct.pack("<I", 1) + struct.pack("<12fH", 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0)
OBJ = b"v 0 0 0\nv 0 1 0\nv 0 1 1\nv 0 0 1\nusemtl steel\nf 1 2 3 4\n"

BASE = {
    "radar.toml": RADAR.encode(),
    "scenario.toml": SCENARIO.encode(),
    "road.toml": ROAD.encode(),
    "recipe.toml": RECIPE.encode(),
    "study.toml": STUDY.encode(),
    "road.xodr": XODR.encode(),
    "xroad.toml": b'name = "x"\nsagitta_m = 0.05\n[[road]]\nname = "x"\nopendrive = "road.xodr"\n',
    "cube.npy": npy(),
    "mesh.glb": glb(),
    "mesh.stl": STL,
    "mesh.obj": OBJ,
    "ti.cfg": TI_CFG.encode(),
    "ti.bin": b"".join(struct.pack("<4h", i % 90, -i % 80, i % 70, i % 60) for i in range(16 * 4 * 64 // 2)),
}
SIMULATE = ["simulate", "scenario.toml", "-o", "out"]
PROCESS = ["process", "cube.npy", "--radar", "radar.toml", "-o", "out"]
RCS = ["rcs", "mesh.glb"]

Case = collections.namedtuple("Case", "name args files exits words needs", defaults=((0, 2), (), None))
CASES = []


def case(name, args, files=None, exits=(0, 2), words=(), needs=None):
    """`exits`: what the run may end with. `words`: each must stand in what is printed. `needs`: a check of the folder."""
    exits = (exits,) if isinstance(exits, int) else exits
    words = (words,) if isinstance(words, str) else words
    CASES.append(Case(name, args, files or {}, exits, words, needs))


# ---- values in TOML: each key of each file with each hostile value ------------------------------------------------------
NOT_NUMBERS = ["nan", "-inf", '"seven"', "true", "[]", "{}", "1979-05-27", "9223372036854775807", "-9223372036854775808", "1e308"]
NUMBERS = ["-1", "0", "1e-300", "1e9", "0.5", "1_000_000_000"]
NOT_TEXT = ["7", "true", "[]", "{}", '"\\u0000"', '"' + "x" * 4000 + '"', '"unifrom"', '"../../etc/passwd"', '""']
NOT_LISTS = ["[1, 2, 3, 9]", "[]", "[nan, 0, 0]", "7", '"a"', "[[1, 2, 3]]", "[1e300, 0, 0]"]
NOT_TABLES = ["7", "[]", "{ nonsense = 1 }", '"x"']
SCALAR = re.compile(r'([A-Za-z_]+) = (\{[^{}]*\}|\[[^\[\]{}]*\]|"[^"]*"|[-+0-9.eE]+|true|false)')


def hostile_for(old):
    if old.startswith('"'):
        return NOT_TEXT
    if old.startswith("["):
        return NOT_LISTS
    if old.startswith("{"):
        return NOT_TABLES
    if old in ("true", "false"):
        return ["7", '"yes"', "[]"]
    return NOT_NUMBERS + NUMBERS


# What can be no number, text, list or table of these files whatever the key is.
NEVER = {"nan", "-inf", "[]", "{}", "1979-05-27", "[[1, 2, 3]]", "{ nonsense = 1 }"}


def mutations(name, file, text, args, a_key):
    """`a_key` hostile values for each key, others for each so that all are met."""
    turn = 0
    for m in SCALAR.finditer(text):
        key, old = m.group(1), m.group(2)
        values = hostile_for(old)
        for _ in range(a_key):
            value = values[turn % len(values)]
            turn += 1
            new = text[:m.start(2)] + value + text[m.end(2):]
            strict = value in NEVER and not (value == "[]" and old == "[]") and key not in ("test", "train", "validation")
            case(f"{name}.{key} = {value[:30]}", args, {file: new.encode()}, 2 if strict else (0, 2), file if strict else ())
    # The same for tables as a whole, keys that are misspelt, twice or without a value.
    for line in sorted({m.group(0).split(" = ")[0] for m in SCALAR.finditer(text)}):
        wrong = re.sub(rf"\b{line} = ", f"{line}x = ", text, count=1)
        case(f"{name}: misspelt {line}", args, {file: wrong.encode()}, 2, file)


mutations("radar", "radar.toml", RADAR, SIMULATE, 4)
mutations("scenario", "scenario.toml", SCENARIO, SIMULATE, 4)
mutations("road", "road.toml", ROAD, ["scene", "road.toml", "-o", "out.glb"], 4)
mutations("recipe", "recipe.toml", RECIPE, ["dataset", "recipe.toml", "-o", "out", "--jobs", "1"], 4)
mutations("study", "study.toml", STUDY, ["study", "study.toml", "-o", "out"], 4)

READERS = [
    ("scenario", "scenario.toml", SIMULATE),
    ("radar", "radar.toml", SIMULATE),
    ("road", "road.toml", ["scene", "road.toml", "-o", "out.glb"]),
    ("opendrive", "road.xodr", ["scene", "xroad.toml", "-o", "out.glb"]),
    ("recipe", "recipe.toml", ["dataset", "recipe.toml", "-o", "out"]),
    ("study", "study.toml", ["study", "study.toml", "-o", "out"]),
    ("cube", "cube.npy", PROCESS),
    ("glb", "mesh.glb", RCS),
    ("stl", "mesh.stl", ["rcs", "mesh.stl", "--unit", "m", "--up", "z", "--default-material", "pec"]),
    ("obj", "mesh.obj", ["rcs", "mesh.obj", "--unit", "m", "--up", "z"]),
    ("ti cfg", "ti.cfg", ["process", "ti.bin", "--cfg", "ti.cfg", "-o", "out"]),
    ("ti bin", "ti.bin", ["process", "ti.bin", "--cfg", "ti.cfg", "-o", "out"]),
]

# ---- files that are none, cut, garbled, or not files -----------------------------------------------------------------
for name, file, args in READERS:
    whole = BASE[file]
    chance = random.Random(zlib.crc32(name.encode()))
    case(f"{name} whole", args, exits=0)
    case(f"{name} empty", args, {file: b""}, 2, file)
    case(f"{name} garbage", args, {file: chance.randbytes(3000)}, 2, file)
    case(f"{name} zeros", args, {file: bytes(5000)}, 2, file)
    case(f"{name} missing", args, {file: None}, 2, file)
    case(f"{name} folder", args, {file: "folder"}, 2, file)
    case(f"{name} fifo", args, {file: "fifo"}, 2, file)
    case(f"{name} device", args, {file: "/dev/zero"}, 2, file)
    case(f"{name} loop of links", args, {file: "loop"}, (1, 2), file)
    case(f"{name} of others", args, {file: b"root:x:0:0:secret-word:/root\nshort-word = \"secret-word\n"}, 2, (file, "secret-word"))
    for at in (0.1, 0.5, 0.9):
        case(f"{name} cut at {at}", args, {file: whole[: int(at * len(whole))]})
    for i in range(6):
        bad = bytearray(whole)
        for _ in range(1 + i):
            bad[chance.randrange(len(bad))] = chance.randrange(256)
        case(f"{name} garbled {i}", args, {file: bytes(bad)})
    case(f"{name} doubled", args, {file: whole + whole})

# ---- meshes -----------------------------------------------------------------------------------------------------------
case("glb of NaN", RCS, {"mesh.glb": glb(positions=((float("nan"), 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)))}, 2)
case("glb of slivers", RCS, {"mesh.glb": glb(positions=((0, 0, 0), (1, 0, 0), (1, 1e-30, 0), (0, 1e-30, 0)))}, (0, 2))
case("glb index out", RCS, {"mesh.glb": glb(indices=(0, 1, 9, 0, 2, 3))}, 2, "mesh.glb")
case("glb in millimetres", RCS, {"mesh.glb": glb(positions=((0, 0, 0), (160, 0, 0), (160, 100, 0), (0, 100, 0)))}, 2, "--unit")
case("glb of micrometres", RCS, {"mesh.glb": glb(positions=((0, 0, 0), (1e-4, 0, 0), (1e-4, 1e-4, 0), (0, 1e-4, 0)))}, 2, "--unit")
case("glb said to be metres", RCS + ["--unit", "m"], {"mesh.glb": glb(positions=((0, 0, 0), (160, 0, 0), (160, 100, 0), (0, 100, 0)))}, 0)
for text, words in [
    ({"eps_r": [2.5, 0, 9]}, "eps_r"), ({"eps_r": [2.5]}, "eps_r"), ({"eps_r": "x"}, "eps_r"), ({"conductivity_s_per_m": -1}, "conductivity"),
    ({"roughness_rms_m": 1e999}, ""), ({"layers": [{"material": "nonsense", "thickness_m": 1}]}, "nonsense"), ({"nonsense": 1}, "nonsense"),
    ({"eps_r": [2, -1]}, "eps_r"), ({"layers": [{"material": "water", "thickness_m": -1}]}, "thickness"), ([], ""), ("x", ""),
]:
    def material(tree, text=text):
        tree["materials"][0]["extras"] = {"catseye": text}
    case(f"glb material {json.dumps(text)[:40]}", RCS, {"mesh.glb": glb(material)}, 2, words)
for text, words in [
    ({"velocity_mps": [1, 2, 3, 4]}, "velocity_mps"), ({"velocity_mps": [1]}, "velocity_mps"), ({"id": -1}, "id"), ({"id": 1e300}, "id"),
    ({"class": 7}, "class"), ({"rcs_dbsm": "x"}, "rcs_dbsm"), ({"nonsense": 1}, "nonsense"), (7, ""),
]:
    def node(tree, text=text):
        tree["nodes"][0]["extras"] = {"catseye": text}
    case(f"glb node {json.dumps(text)[:40]}", RCS, {"mesh.glb": glb(node)}, 2, words)


def with_buffer(uri):
    def change(tree):
        tree["buffers"][0]["uri"] = uri
    return change


for uri in ("../../../etc/passwd", "/etc/passwd", "https://example.org/x.bin", "missing.bin", "data:application/octet-stream;base64,!!!", "%00.bin"):
    case(f"glb buffer {uri[:20]}", RCS, {"mesh.glb": glb(with_buffer(uri))})
case("stl without material", ["rcs", "mesh.stl", "--unit", "m", "--up", "z"], exits=2, words="--default-material")
case("stl without unit", ["rcs", "mesh.stl", "--up", "z"], exits=2, words="--unit")
case("stl without up", ["rcs", "mesh.stl", "--unit", "mm"], exits=2, words="--up")
case("obj without unit", ["rcs", "mesh.obj"], exits=2, words="--unit")
case("stl of a billion facets", ["rcs", "mesh.stl", "--unit", "m", "--up", "z", "--default-material", "pec"], {"mesh.stl": b"\0" * 80 + struct.pack("<I", 1_000_000_000)}, 2)
case("stl binary", ["rcs", "mesh.stl", "--unit", "m", "--up", "z", "--default-material", "pec"], {"mesh.stl": STL_BINARY}, 0)
case("stl binary of NaN", ["rcs", "mesh.stl", "--unit", "m", "--up", "z", "--default-material", "pec"],
     {"mesh.stl": b"\0" * 80 + struct.pack("<I", 1) + struct.pack("<12fH", 1, 0, 0, float("nan"), 0, 0, 0, 1, 0, 0, 0, 1, 0)}, 2)
for text in (b"f 1 2 3\n", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99\n", b"v 0 0\nf 1 1 1\n", b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
             b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -9 2 3\n", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"):
    case(f"obj {text[-14:]!r}", ["rcs", "mesh.obj", "--unit", "m", "--up", "z"], {"mesh.obj": text}, 2, "mesh.obj")
OBJ = ["rcs", "mesh.obj", "--unit", "m", "--up", "z", "--default-material", "pec"]
SQUARE = "v 0 0 0\nv 0 0.1 0\nv 0 0.1 0.1\nv 0 0 0.1\nv 0.1 0 0\n"
for name, faces, words in [
    ("twice and flipped", "f 1 2 3\nf 1 2 3\nf 3 2 1\nf 1 3 4\n", "counts once"), ("without area", "f 1 2 3\nf 1 2 2\nf 1 3 4\n", ""),
    ("with three faces at an edge", "f 1 2 3\nf 1 3 4\nf 1 3 5\n", ""), ("with normals of zero", "vn 0 0 0\nf 1//1 2//1 3//1\nf 1//1 3//1 4//1\n", ""),
    ("with slanting normals", "vn 1 1 1\nvn -1 0 1\nf 1//1 2//2 3//1\nf 1//2 3//1 4//2\n", ""), ("of one triangle", "vn 1 0 0\nf 1//1 2//1 3//1\n", ""),
    ("with folds over itself", "f 1 2 3\nf 1 3 2\nf 1 3 4\nf 1 4 3\n", "counts once"),
]:
    case(f"obj {name}", OBJ, {"mesh.obj": (SQUARE + faces).encode()}, 0, words)
    case(f"obj {name}, checked", ["scene", "mesh.obj", "--check", "--unit", "m", "--up", "z", "--default-material", "pec"], {"mesh.obj": (SQUARE + faces).encode()}, 0, "warnings")
case("obj with normals of NaN", OBJ, {"mesh.obj": (SQUARE + "vn nan 0 0\nf 1//1 2//1 3//1\n").encode()}, 2, "mesh.obj")
case("an open body of plastic", ["rcs", "mesh.obj", "--unit", "m", "--up", "z", "--default-material", "polypropylene"], {"mesh.obj": (SQUARE + "f 1 3 2\nf 1 5 3\nf 2 3 5\n").encode()}, 0, "is not closed")
for angle in ("nan", "-1", "61", "x", "1e300"):
    case(f"smooth deg {angle}", [*OBJ, f"--smooth-deg={angle}"], {"mesh.obj": (SQUARE + "f 1 2 3\n").encode()}, 2, "smooth-deg")
case("a rod of plastic", ["rcs", "cylinder:radius_m=0.005,length_m=0.1,material=polypropylene"], exits=2, words="curved")
for name in ("eps", "eps0", "eps-1", "epsnan", "eps2-j", "eps1e99", "eps2.5.5", "air+eps0:0.001"):
    case(f"material {name}", ["rcs", f"plate:material={name}"], exits=2, words="eps")
case("checked and written", ["scene", "mesh.glb", "--check", "-o", "out.glb"], exits=2, words="--check")
case("a file name is no kind", ["rcs", "missing.stl", "--unit", "m", "--up", "z"], exits=2, words="no such file")

# ---- cubes ----------------------------------------------------------------------------------------------------------------
for name, data in [
    ("of a million chirps", npy((1_000_000, 2, 64), data=b"")), ("of no shape", npy((), data=b"12345678")), ("flat", npy((2048,))),
    ("of another shape", npy((8, 2, 64))), ("of too many channels", npy((16, 9, 64))), ("of text", npy(descr="<U8")), ("of objects", npy(descr="|O")),
    ("big endian", npy(descr=">c8")), ("of zero samples", npy((16, 2, 0), data=b"")), ("Fortran", npy(order="True")), ("with more behind", npy() + b"x" * 99),
    ("of version 9", npy(version=b"\x09\x00")), ("of NaN", npy(data=struct.pack("<2f", float("nan"), 0) * 2048)),
    ("of infinities", npy(data=struct.pack("<2f", float("inf"), 0) * 2048)), ("of 10^18", npy((10**6, 10**6, 10**6), data=b"")),
    ("of negative shape", npy(data=b"").replace(b"(16, 2, 64)", b"(-6, 2, 64)")), ("of huge header", b"\x93NUMPY\x02\x00" + b"\xff\xff\xff\x7f" + b" " * 99),
]:
    case(f"cube {name}", PROCESS, {"cube.npy": data}, (0, 2) if "Fortran" in name or "endian" in name or "behind" in name else 2)
for axes in ("chirp", "chirp,rx", "chirp,rx,sample,frame,rx", "chirp,chirp,sample", "nonsense", "", "sample,rx,chirp"):
    case(f"axes {axes}", PROCESS + ["--axes", axes], exits=2)
case("frame 7 of 1", PROCESS + ["--frame", "7"], exits=2)
case("frame -1", PROCESS + ["--frame", "-1"], exits=2)
for line in ("profileCfg 0 77 429 7 57.14 0 0 70 1 1000000000 5209 0 0 30", "profileCfg 0 nan 429 7 57.14 0 0 70 1 64 5209 0 0 30", "profileCfg 0 77",
             "profileCfg 0 77 429 7 57.14 0 0 70 1 64 0 0 0 30", "profileCfg 0 77 429 7 57.14 0 0 70 1 -64 5209 0 0 30", "profileCfg 0 77 429 7 57.14 0 0 1e300 1 64 5209 0 0 30"):
    case(f"ti {line[:50]}", ["process", "ti.bin", "--cfg", "ti.cfg", "-o", "out"],
         {"ti.cfg": re.sub(r"profileCfg.*", line, TI_CFG).encode()}, 2, "ti.cfg")
for line in ("frameCfg 0 0 1000000000 1 100 1 0", "frameCfg 5 0 16 1 100 1 0", "frameCfg 0 511 255 1 100 1 0", "frameCfg"):
    case(f"ti {line[:50]}", ["process", "ti.bin", "--cfg", "ti.cfg", "-o", "out"], {"ti.cfg": re.sub(r"frameCfg.*", line, TI_CFG).encode()}, 2)
for line in ("channelCfg 0 0 0", "channelCfg 99999 1 0", "channelCfg -1 1 0", "channelCfg 15 x 0"):
    case(f"ti {line}", ["process", "ti.bin", "--cfg", "ti.cfg", "-o", "out"], {"ti.cfg": re.sub(r"channelCfg.*", line, TI_CFG).encode()}, 2)

# ---- roads from OpenDRIVE -----------------------------------------------------------------------------------------------
for old, new, exits in [
    ('length="40"', 'length="500"', (0, 2)), ('length="20"><line', 'length="-5"><line', 2), ('curvature="0.01"', 'curvature="nan"', 2), ('curvature="0.01"', 'curvature="1e9"', 2),
    ('s="20" x', 's="5" x', 2), ("<line/>", "<nonsense/>", 2), ('id="1" type', 'id="1e9" type', 2), ('a="3.5"', 'a="-3.5"', (0, 2)), ('a="3.5"', 'a="1e300"', 2), ('a="3.5"', "", 2),
    ('revMajor="1"', 'revMajor="99"', (0, 2)), ("<OpenDRIVE>", '<!DOCTYPE x [<!ENTITY a "b">]><OpenDRIVE>', 2), ('id="1" length', "length", 2), ('length="40"', 'length="1e12"', 2),
    ('b="0.01"', 'b="1e9"', (0, 2)), ('x="20"', 'x="1e300"', 2), ('x="20"', 'x="900"', (0, 2)), ('width="0.12"', 'width="-1"', (0, 2)),
]:
    case(f"opendrive {new[:40]}", ["scene", "xroad.toml", "-o", "out.glb"], {"road.xodr": XODR.replace(old, new, 1).encode()}, exits)

# ---- counts and sizes that nobody has the memory for --------------------------------------------------------------------
for key, old, new in [
    ("chirps x samples", "chirps = 16", "chirps = 1000000"), ("doppler_fft", "doppler_fft = 16", "doppler_fft = 1000000000"), ("range_fft", "range_fft = 64", "range_fft = 1000000000"),
    ("azimuth_bins", "azimuth_bins = 16", "azimuth_bins = 1000000000"), ("elevation_bins", "elevation_bins = 1", "elevation_bins = 1000000000"), ("max_points", "max_points = 64", "max_points = 9000000000000000000"),
    ("samples", "samples = 64", "samples = 4000000000"), ("train cells", "train_range_cells = 4", "train_range_cells = 1000000000"),
]:
    case(f"memory: {key}", SIMULATE, {"radar.toml": RADAR.replace(old, new).encode()}, (0, 2))
    case(f"memory of a dry run: {key}", ["simulate", "scenario.toml", "--dry-run"], {"radar.toml": RADAR.replace(old, new).encode()}, (0, 2))
both = RADAR.replace("chirps = 16", "chirps = 32768").replace("samples = 64", "samples = 32768").replace("12.8e-6", "2000e-6").replace("16e-6", "2010e-6").replace("range_fft = 64\n", "").replace("doppler_fft = 16\n", "")
case("memory: 10^9 samples a channel", SIMULATE, {"radar.toml": both.encode()}, 2, "GiB")
case("memory: transforms of 10^5 each", SIMULATE, {"radar.toml": RADAR.replace("range_fft = 64", "range_fft = 100000").replace("doppler_fft = 16", "doppler_fft = 100000").encode()}, 2, "GiB")
for key, old, new in [
    ("dashes", "dash_m = 4, gap_m = 8", "dash_m = 1e-9, gap_m = 1e-9"), ("posts", "post_spacing_m = 4", "post_spacing_m = 1e-9"), ("markers", "spacing_m = 5\ncount = 3", "spacing_m = 1e-9"),
    ("count", "count = 3", "count = 1000000000"), ("sagitta", "sagitta_m = 0.02", "sagitta_m = 1e-12"), ("length", "length_m = 20 }, {", "length_m = 1e12 }, {"), ("radius", "radius_m = 100", "radius_m = 1e-9"),
]:
    case(f"memory of a road: {key}", ["scene", "road.toml", "-o", "out.glb"], {"road.toml": ROAD.replace(old, new).encode()}, 2, "road.toml")
case("scenes by the billion", ["dataset", "recipe.toml", "-o", "out"], {"recipe.toml": RECIPE.replace("scenes = 2", "scenes = 4000000000").encode()}, 2)
case("frames by the billion", SIMULATE[:2] + ["-o", "out", "--frames", "4294967295", "--dry-run"], exits=(0, 2))
case("a sweep of 10^12", ["study", "study.toml", "-o", "out"], {"study.toml": STUDY.replace("step = 1", "step = 1e-12").encode()}, 2)
for option in ("--azimuth-deg", "--elevation-deg", "--frequency-hz"):
    case(f"{option} by billionths", ["rcs", "plate", option, "1:90:1e-9"], exits=2)
for target in ("plate:width_m=1e9", "plate:width_m=-1", "plate:width_m=nan", "plate:width_m=", "plate:nonsense=1", "plate:", "plat", "sphere:radius_m=1e-300", "chaff:count=1000000000", "mesh:cell_m=1e-9",
               "sphere:radius_m=100,sagitta_m=1e-9", "type3:ball_m=1e-9", "trihedral:leg_m=inf", "type1:width_m=0.16,width_m=0.2", "plate:width_m=0.1;height_m=1", "point:rcs_dbsm=1e999", ":", "", "plate:=1"):
    case(f"target {target}", ["rcs", target], exits=2)

# ---- the command line --------------------------------------------------------------------------------------------------
for words in [
    ["--nonsense"], ["nonsense"], ["rcs"], ["rcs", "plate", "--azimuth-deg", "0:1"], ["rcs", "plate", "--azimuth-deg", "nan"], ["rcs", "plate", "--azimuth-deg", "a,b"], ["rcs", "plate", "--azimuth-deg", ""],
    ["rcs", "plate", "--elevation-deg", "91"], ["rcs", "plate", "--frequency-hz", "0"], ["rcs", "plate", "--frequency-hz", "-1"], ["rcs", "plate", "--frequency-hz", "1e30"], ["rcs", "plate", "--range-m", "0"], ["rcs", "plate", "--range-m", "-5"],
    ["rcs", "plate", "--range-m", "nan"], ["rcs", "plate", "--bounces", "0"], ["rcs", "plate", "--bounces", "1000000"], ["rcs", "plate", "--bounces", "x"], ["rcs", "plate", "--accuracy-db", "0"], ["rcs", "plate", "--accuracy-db", "nan"],
    ["rcs", "plate", "--ground", "nonsense"], ["rcs", "plate", "--height-m", "nan"], ["rcs", "plate", "--diffraction", "x"], ["rcs", "plate", "--convention", "x"], ["rcs", "plate", "--polarisation", "x"],
    ["rcs", "plate", "--device", "nonsense"], ["rcs", "plate", "--device", ""], ["rcs", "plate", "--precision", "f16"], ["rcs", "plate", "--default-material", "unobtainium"], ["rcs", "mesh.glb", "--material", "steel"],
    ["rcs", "mesh.glb", "--material", "steel=unobtainium"], ["rcs", "mesh.glb", "--unit", "furlong"], ["rcs", "mesh.glb", "--up", "w"], ["rcs", "plate", "--bistatic-azimuth-deg", "nan"], ["rcs", "x" * 5000], ["rcs", "\x01"],
    ["simulate"], ["simulate", "scenario.toml"], ["simulate", "scenario.toml", "-o", ""], ["simulate", "scenario.toml", "-o", "out", "--frames", "0"], ["simulate", "scenario.toml", "-o", "out", "--frames", "-1"],
    ["simulate", "scenario.toml", "-o", "out", "--frames", "1e3"], ["simulate", "road.toml", "-o", "out"], ["simulate", "radar.toml", "-o", "out"], ["simulate", "mesh.glb", "-o", "out"],
    ["process", "cube.npy", "-o", "out"], ["process", "cube.npy", "--radar", "nonsense", "-o", "out"], ["process", "cube.npy", "--radar", "scenario.toml", "-o", "out"], ["process", "mesh.glb", "--radar", "radar.toml", "-o", "out"],
    ["process", "cube.npy", "--radar", "/etc/passwd", "-o", "out"], ["convert", "cube.npy", "-o", "out.xlsx"], ["convert", "cube.npy", "-o", "out"], ["export", "out", "--format", "pcd", "-o", "x"], ["export", ".", "--format", "tusimple", "-o", "x"],
    ["export", ".", "--format", "nonsense", "-o", "x"], ["calibrate", "--radar", "radar.toml", "-o", "c.csv", "--range-m", "-1"], ["calibrate", "--radar", "x", "-o", "c.csv"],
    ["plot", "radar.toml"], ["plot", "missing.csv"], ["plot", "mesh.glb"], ["plot"], ["verify", "."], ["verify", "missing"], ["verify", "radar.toml"], ["diff", "cube.npy"], ["diff", "cube.npy", "missing.npy"], ["diff", "cube.npy", "radar.toml"], ["diff", "mesh.glb", "mesh.glb"], ["diff", ".", "."],
    ["diff", "cube.npy", "cube.npy", "--relative", "nan"], ["diff", "cube.npy", "cube.npy", "--match-m", "inf"], ["diff", "/dev/zero", "cube.npy"], ["lane", "nonsense", "scenario.toml", "-o", "out"], ["lane", "compare", "-o", "out"],
    ["init", "nonsense"], ["init", "scenario", "-o", "."], ["init"], ["scene", "scenario.toml", "-o", "x.glb"], ["scene", "road.toml", "-o", "."], ["reflector", "nonsense", "-o", "x.glb"],
    ["reflector", "plate", "-o", "x.xyz"], ["reflector", "plate", "--width-m", "-1", "-o", "x.glb"], ["reflector", "plate", "--nonsense", "1", "-o", "x.glb"], ["dataset", "recipe.toml", "-o", "out", "--jobs", "0"],
    ["dataset", "recipe.toml", "-o", "out", "--jobs", "x"], ["dataset", "recipe.toml", "-o", "out", "--shards", "2:1"], ["dataset", "recipe.toml", "-o", "out", "--shards", "x"], ["dataset", "recipe.toml", "-o", "out", "--shards", "5:9"],
    ["dataset", "recipe.toml", "-o", "out", "--scene", "99"], ["bench", "--only", "W99"], ["study", "missing", "-o", "out"], ["examples", "nonsense"], ["study", "study.toml", "-o", "study.toml"],
    ["simulate", "scenario.toml", "-o", "scenario.toml"], ["simulate", "scenario.toml", "-o", "scenario.toml/out"], ["rcs", "plate", "--seed", "-1"], ["simulate", "scenario.toml", "-o", "out", "--seed", "x"],
    ["rcs", "plate", "-o", "o.xlsx"], ["rcs", "plate", "--plot", "o.jpg"], ["rcs", "plate", "--plot", "o.svgz"], ["calibrate", "--radar", "radar.toml", "-o", "c.xlsx"], ["plot", "cube.npy", "-o", "p.jpg"], ["scene", "road.toml", "-o", "x.fbx"],
]:
    case("$ " + " ".join(words)[:60], words, exits=2)
    if words and words[0] in ("rcs", "simulate", "process"):
        case("--json $ " + " ".join(words)[:60], words + ["--json"], exits=2, words='"error"')

# ---- files that name others --------------------------------------------------------------------------------------------
for name, file, text, where in [
    ("radar of a scenario", "scenario.toml", SCENARIO.replace("radar.toml", "gone.toml"), "scenario.toml:4"),
    ("road of a scenario", "scenario.toml", SCENARIO.replace('builtin = "empty"', 'road = "gone.toml"'), "scenario.toml:7"),
    ("scene of a scenario", "scenario.toml", SCENARIO.replace('builtin = "empty"', 'file = "gone.glb"'), "scenario.toml:7"),
    ("object of a scenario", "scenario.toml", SCENARIO.replace('reflector = "plate:width_m=0.1,height_m=0.1"', 'file = "gone.glb"'), "scenario.toml:16"),
    ("table of an object", "scenario.toml", SCENARIO.replace('reflector = "plate:width_m=0.1,height_m=0.1"', 'rcs_table = "gone.csv"'), "scenario.toml:16"),
    ("calibration of a radar", "radar.toml", RADAR.replace('method = "bartlett"', 'method = "ml"\nsources = 1\ncalibration_file = "gone.csv"'), "radar.toml"),
    ("pattern of a radar", "radar.toml", RADAR.replace('pattern = "cosine-power"\nazimuth_exponent = 1.6\nelevation_exponent = 36', 'pattern = "table"\ntable_file = "gone.csv"'), "radar.toml"),
]:
    case(f"missing {name}", SIMULATE, {file: text.encode()}, 2, (where, "gone"))
case("missing road of a study's target", ["study", "study.toml", "-o", "out"], {"study.toml": STUDY.replace("plate:width_m=0.1,height_m=0.1", "gone.glb").encode()}, 2, ("study.toml", "gone"))
case("missing radar of a recipe", ["dataset", "recipe.toml", "-o", "out"], {"recipe.toml": RECIPE.replace("radar.toml", "gone.toml").encode()}, 2, ("recipe.toml", "gone"))
case("missing OpenDRIVE", ["scene", "xroad.toml", "-o", "out.glb"], {"road.xodr": None}, 2, ("xroad.toml", "road.xodr"))
case("misspelt distribution", ["dataset", "recipe.toml", "-o", "out"], {"recipe.toml": RECIPE.replace("rcs_dbsm = { uniform", "rcs_dbsm = { unifrom").encode()}, 2, "uniform")
case("a later scene out of range", ["dataset", "recipe.toml", "-o", "out"],
     {"recipe.toml": RECIPE.replace("scenes = 2", "scenes = 40").replace("speed_mps = { choice = [1, 2] }", "speed_mps = { uniform = [1, 400] }").replace("train = [0]\nvalidation = [1]\ntest = []", "train = 1.0").encode()}, (0, 2))

# ---- where a radar cannot stand -----------------------------------------------------------------------------------------
case("radar under the road", SIMULATE, {"scenario.toml": SCENARIO.replace('builtin = "empty"', 'road = "road.toml"').encode(), "radar.toml": RADAR.replace("[3.6, 0, 0.5]", "[3.6, 0, -0.5]").encode()}, (0, 2), "radar")
case("surplus elements", SIMULATE, {"scenario.toml": SCENARIO.replace("[15, 1, 0.5]", "[15, 1, 0.5, 9]").encode()}, 2, ("scenario.toml:11", "position_m"))
case("too few elements", SIMULATE, {"scenario.toml": SCENARIO.replace("[15, 1, 0.5]", "[15, 1]").encode()}, 2, ("scenario.toml:11", "position_m"))

# ---- outputs that would lose something ------------------------------------------------------------------------------------
FOREIGN = {"out/manifest.json": b'{"name": "web-project", "start_url": "/"}', "out/index.html": b"<html>"}
for command in (SIMULATE, PROCESS, ["demo", "-o", "out"], ["study", "study.toml", "-o", "out"], ["dataset", "recipe.toml", "-o", "out"], ["lane", "markers", "scenario.toml", "-o", "out"]):
    for files in (FOREIGN, {"out/manifest.json": b"{}"}, {"out/manifest.json": b"not json"}, {"out/notes.txt": b"mine"}, {"out/dataset.json": b"{}", "out/mine": b"x"}):
        case(f"{command[0]} into {sorted(files)[-1]} of others", command + ["--force"], files, 2, needs=lambda folder, files=files: all((folder / f).read_bytes() == b for f, b in files.items()))
    case(f"{command[0]} onto a file", command + ["--force"], {"out": b"mine"}, 2, needs=lambda folder: (folder / "out").read_bytes() == b"mine")
case("output over input", ["rcs", "mesh.glb", "-o", "mesh.glb", "--force"], exits=2, needs=lambda folder: (folder / "mesh.glb").read_bytes() == BASE["mesh.glb"])
case("two outputs of one name", ["rcs", "plate", "-o", "o.csv", "--plot", "o.csv"], exits=2)
case("two outputs of one name, another way", ["rcs", "plate", "-o", "o.csv", "--plot", "./o.csv", "--force"], exits=2)
case("calibration over the radar", ["calibrate", "--radar", "radar.toml", "-o", "radar.toml", "--force"], exits=2, needs=lambda folder: (folder / "radar.toml").read_bytes() == BASE["radar.toml"])
case("scene over the road", ["scene", "road.toml", "-o", "road.toml", "--force"], exits=2, needs=lambda folder: (folder / "road.toml").read_bytes() == BASE["road.toml"])
case("cube over itself", ["convert", "cube.npy", "--radar", "radar.toml", "-o", "cube.npy", "--force"], exits=2, needs=lambda folder: (folder / "cube.npy").read_bytes() == BASE["cube.npy"])
case("points into a full device", ["rcs", "plate", "-o", "/dev/full"], exits=(1, 2))
case("into a file that is no folder", ["simulate", "scenario.toml", "-o", "radar.toml/out"], exits=(1, 2))
case("a name too long", ["simulate", "scenario.toml", "-o", "x" * 300], exits=(1, 2))


def run_of(folder):
    """A complete run lies in `out`."""
    return json.loads((folder / "out/manifest.json").read_bytes())["checksums"]


# ---- tries that take several runs -----------------------------------------------------------------------------------------
ENV = {**os.environ, "NO_COLOR": "1"}
Result = collections.namedtuple("Result", "code out err seconds")


def limit(kind, value):
    def before():
        resource.setrlimit(kind, (value, value))
        # Python starts others with the default again, which ends a program whose file grows too large.
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)

    return before


def start(program, args, folder, before=None, env=None):
    return subprocess.Popen([program, *args], cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                            preexec_fn=before, restore_signals=False,
                            env={**ENV, **(env or {})}, start_new_session=True)


def finish(process, seconds=SECONDS):
    begin = time.monotonic()
    try:
        out, err = process.communicate(timeout=seconds)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return Result(None, "", f"did not end within {seconds} s", seconds)
    return Result(process.returncode, out.decode(errors="replace"), err.decode(errors="replace"), time.monotonic() - begin)


def run(program, args, folder, before=None, env=None, seconds=SECONDS):
    return finish(start(program, args, folder, before, env), seconds)


SCENARIOS = []


def story(function):
    SCENARIOS.append(function)
    return function


def furnish(folder, files=()):
    folder.mkdir(exist_ok=True)
    for name, content in {**BASE, **dict(files)}.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if content is None:
            continue
        if content == "folder":
            path.mkdir()
        elif content == "fifo":
            os.mkfifo(path)
        elif content == "loop":
            path.symlink_to(path.name)
        elif isinstance(content, str):
            path.symlink_to(content)
        else:
            path.write_bytes(content)


def fine(result, what):
    """Ended well."""
    return [] if result.code == 0 else [f"{what}: ended with {result.code}: {result.err[-300:]}"]


def ends(result, codes, what):
    out = [] if result.code in codes else [f"{what}: ended with {result.code} and not {codes}: {result.err[-300:]}"]
    return out + manners(result, what)


def manners(result, what, files=()):
    wrong = []
    text = result.err + result.out
    if result.code is None or result.code < 0 or result.code in (101, 134):
        wrong.append(f"{what}: ended with {result.code}: {result.err[-300:]}")
    if "panicked" in text:
        wrong.append(f"{what}: panic: {text[-300:]}")
    if result.code == 2:
        lines = [line for line in result.err.splitlines() if line.startswith("error:")]
        if len(lines) != 1:
            wrong.append(f"{what}: {len(lines)} lines of error: {result.err[-300:]}")
        for line in lines:
            plain = re.sub(r"[^ ;:,]*x{50,}[^ ;:,]*", "", line)
            if len(plain) > 300 and "no material is named" not in plain:
                wrong.append(f"{what}: {len(plain)} characters: {line}")
            found = RUST.search(line)
            if found and found.group(0) not in what and "--precision" not in what:
                wrong.append(f"{what}: names '{found.group(0)}': {line}")
    return wrong


def leavings(folder, known):
    return sorted(str(p.relative_to(folder)) for p in folder.rglob("*") if str(p.relative_to(folder)) not in known)


def one(program, case, folder):
    furnish(folder, case.files)
    known = {str(p.relative_to(folder)) for p in folder.rglob("*")}
    inputs = {name: (folder / name).read_bytes() for name in BASE if (folder / name).is_file()}
    # A device without an end would fill the machine's memory where it is read.
    result = run(program, case.args, folder, before=limit(resource.RLIMIT_AS, 4 << 30) if " device" in case.name else None)
    wrong = manners(result, case.name)
    if result.code not in case.exits:
        wrong.append(f"{case.name}: ended with {result.code} and not {case.exits}: {(result.err or result.out)[-400:]}")
    text = result.err + result.out
    for word in case.words:
        if word == "secret-word":
            if word in text:
                wrong.append(f"{case.name}: shows what stands in a foreign file: {text[-300:]}")
        elif word not in text:
            wrong.append(f"{case.name}: does not say '{word}': {text[-400:]}")
    if result.code in (1, 2):
        left = leavings(folder, known)
        if left:
            wrong.append(f"{case.name}: leaves {left[:4]}")
    for name, was in inputs.items():
        if not (folder / name).is_file() or (folder / name).read_bytes() != was:
            wrong.append(f"{case.name}: changed {name}")
    if case.needs and not case.needs(folder):
        wrong.append(f"{case.name}: spoilt what lay there")
    return wrong


LONGER = {"scenario.toml": SCENARIO.replace("count = 1", "count = 12").encode()}


def tree_of(folder):
    """Bytes of a run, without what carries times."""
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file() and p.name not in ("manifest.json",)}


def killed(program, folder, args, shares, whole_s):
    """Kills a run at shares of its time; the same command completes it."""
    for share in shares:
        process = start(program, args, folder)
        try:
            process.wait(share * whole_s)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        if process.returncode == 0:
            break
    if process.returncode == 0:
        return Result(0, "", "", 0)
    result = run(program, args, folder)
    # Killed after all was in place.
    return Result(0, "", "", 0) if result.code == 2 and "exists already" in result.err else result


def add_kill(kind, args, files, share):
    def kill(program, folder):
        furnish(folder / "a", files)
        begin = time.monotonic()
        wrong = fine(run(program, args, folder / "a"), kind)
        whole_s = time.monotonic() - begin
        furnish(folder / "b", files)
        wrong += fine(killed(program, folder / "b", args, (share, 0.5 * share), whole_s), f"{kind} after a kill at {share}")
        if wrong:
            return wrong
        a, b = tree_of(folder / "a/out"), tree_of(folder / "b/out")
        if a != b:
            wrong.append(f"{kind} killed at {share}: other files: {sorted(set(a) ^ set(b)) or [k for k in a if a[k] != b.get(k)]}")
        wrong += fine(run(program, ["verify", "out"], folder / "b"), f"{kind}: verify")
        left = [p for p in leavings(folder / "b", {str(p.relative_to(folder / "a")) for p in (folder / "a").rglob("*")})]
        return wrong + ([f"{kind} killed at {share}: leaves {left[:5]}"] if left else [])
    kill.__name__ = f"{kind} killed at {share}"
    SCENARIOS.append(kill)


MANY = {"recipe.toml": RECIPE.replace("scenes = 2", "scenes = 12").replace("train = [0]\nvalidation = [1]\ntest = []", "train = [\"0-11\"]").encode()}
for share in (0.15, 0.3, 0.45, 0.6, 0.75, 0.9):
    add_kill("simulate", SIMULATE, LONGER, share)
for share in (0.25, 0.35, 0.45, 0.55, 0.65, 0.9):
    add_kill("dataset", ["dataset", "recipe.toml", "-o", "out"],
             {"recipe.toml": RECIPE.replace("scenes = 2", "scenes = 8").replace("train = [0]", "train = [0, 2, 3, 4, 5, 6, 7]").encode()}, share)


@story
def spoilt_frames_are_made_again(program, folder):
    """A power cut leaves files of a finished frame empty."""
    furnish(folder, LONGER)
    wrong = []
    for spoil in ("adc.npy", "truth.json", "points.csv"):
        process = start(program, SIMULATE, folder)
        hidden = folder / ".out.unfinished/result/frame_000000"
        deadline = time.monotonic() + SECONDS
        while not hidden.is_dir() and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.002)
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        if not (hidden / spoil).is_file():
            return [f"no finished frame to spoil: {list(folder.rglob('*'))[:9]}"] if not (folder / "out").exists() else []
        (hidden / spoil).write_bytes(b"")
        wrong += fine(run(program, SIMULATE, folder), "resume")
        if not (folder / f"out/frame_000000/{spoil}").stat().st_size:
            wrong.append(f"an emptied {spoil} landed in the result")
        shutil.rmtree(folder / "out")
    return wrong


@story
def damaged_echoes_are_refused(program, folder):
    """A run's kept echoes, cut short, garbled and exchanged, with and without a checksum that says so."""
    furnish(folder, {"scenario.toml": SCENARIO.replace("[output]", "[output]\nechoes = true").encode() if "[output]" in SCENARIO
                     else (SCENARIO + "\n[output]\nechoes = true\n").encode()})
    wrong = fine(run(program, SIMULATE, folder), "simulate")
    again = ["simulate", "scenario.toml", "--from", "out", "-o", "again"]
    wrong += fine(run(program, again, folder), "from whole echoes")
    shutil.rmtree(folder / "again")
    manifest, frame = folder / "out/manifest.json", folder / "out/frame_000000"
    listed = json.loads(manifest.read_bytes())
    listed["checksums"] = {k: v for k, v in listed["checksums"].items() if "echoes" not in k}
    unlisted = json.dumps(listed).encode()
    table, origin = (frame / "echoes.npy").read_bytes(), (frame / "echoes.json").read_bytes()
    tree = json.loads(origin)
    nan = table[:-8] + struct.pack("<d", math.nan)
    huge = table[:-8] + struct.pack("<d", 1e300)
    cases = [
        ("echoes.npy", bad) for bad in (b"", table[:-8], table[:200], nan, huge, b"not npy", npy(), table.replace(b"<f8", b"<f4"))
    ] + [
        ("echoes.json", bad)
        for bad in (b"", b"{}", b"[]", b"not json", origin[:-9], json.dumps({**tree, "version": 9}).encode(), json.dumps({**tree, "bounces": -1}).encode(),
                    json.dumps({**tree, "origin": None}).encode(), b"[" * 100000)
    ]
    for name, bad in cases:
        for text in (manifest.read_bytes(), unlisted):
            kept = manifest.read_bytes()
            manifest.write_bytes(text)
            (frame / name).write_bytes(bad)
            what = f"{name} of {len(bad)} bytes {bad[:20]!r}"
            wrong += ends(run(program, again, folder), (2,), what)
            if (folder / "again").exists():
                wrong.append(f"{what}: left a result")
            manifest.write_bytes(kept)
        (frame / "echoes.npy").write_bytes(table)
        (frame / "echoes.json").write_bytes(origin)
    for text in (b"", b"{}", b"not json", b'{"radar": 3, "frames": [], "checksums": {}}'):
        manifest.write_bytes(text)
        wrong += ends(run(program, again, folder), (2,), f"a manifest of {len(text)} bytes")
    return wrong


@story
def two_writers(program, folder):
    furnish(folder, LONGER)
    processes = [start(program, SIMULATE, folder) for _ in range(2)]
    results = [finish(p) for p in processes]
    codes = sorted(r.code for r in results)
    wrong = [] if codes == [0, 2] else [f"two writers end with {codes}"]
    for r in results:
        wrong += manners(r, "two writers")
    return wrong + fine(run(program, ["verify", "out"], folder), "what two writers left")


@story
def two_writers_of_two_scenarios(program, folder):
    furnish(folder, {**LONGER, "other.toml": LONGER["scenario.toml"].replace(b'name = "s"', b'name = "other"')})
    processes = [start(program, ["simulate", f, "-o", "out"], folder) for f in ("scenario.toml", "other.toml")]
    results = [finish(p) for p in processes]
    codes = sorted(r.code for r in results)
    return ([] if codes == [0, 2] else [f"two writers end with {codes}"]) + fine(run(program, ["verify", "out"], folder), "what two writers left")


@story
def force_replaces_own_results_alone(program, folder):
    furnish(folder)
    wrong = fine(run(program, SIMULATE, folder), "simulate")
    wrong += ends(run(program, SIMULATE, folder), (2,), "a second time without --force")
    wrong += fine(run(program, SIMULATE + ["--force"], folder), "with --force")
    (folder / "out/notes.txt").write_text("mine")
    wrong += ends(run(program, SIMULATE + ["--force"], folder), (2,), "with the user's notes in it")
    if not (folder / "out/notes.txt").is_file():
        wrong.append("the user's notes are gone")
    return wrong


@story
def no_other_kind_is_replaced(program, folder):
    furnish(folder)
    wrong = fine(run(program, SIMULATE, folder), "simulate")
    wrong += ends(run(program, ["process", "out/frame_000000/adc.npy", "--radar", "radar.toml", "-o", "out", "--force"], folder), (2,), "process over a run")
    return wrong + fine(run(program, ["verify", "out"], folder), "verify")


def add_limit(name, kind, values, args, codes=(0, 1, 2), env=None):
    for value in values:
        def limited(program, folder, value=value):
            furnish(folder)
            before = limit(kind, value) if kind is not None else None
            return ends(run(program, args, folder, before=before, env=env), codes, f"{name} {value}")
        limited.__name__ = f"{name} {value}: {args[0]}"
        SCENARIOS.append(limited)


for args in (SIMULATE, PROCESS, ["rcs", "plate", "--azimuth-deg", "0:90:0.1"], ["scene", "road.toml", "-o", "out.glb"], ["demo"]):
    add_limit("address space", resource.RLIMIT_AS, [100 << 20, 300 << 20, 600 << 20], args)
    add_limit("size of files", resource.RLIMIT_FSIZE, [0, 4096], args)
    add_limit("open files", resource.RLIMIT_NOFILE, [4, 8], args)
    add_limit("processor time", resource.RLIMIT_CPU, [60], args)
for threads in ("0", "1", "1000000", "-1", "x"):
    add_limit(f"RAYON_NUM_THREADS={threads}", None, [0], SIMULATE, (0, 2), {"RAYON_NUM_THREADS": threads})


@story
def closed_stdout(program, folder):
    furnish(folder)
    process = subprocess.Popen(["sh", "-c", '"$0" rcs plate --azimuth-deg 0:90:0.01 | head -n 1', program], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=ENV)
    _, err = process.communicate(timeout=SECONDS)
    return [f"closed pipe: {err[-200:]}"] if b"panicked" in err else []


@story
def interrupted(program, folder):
    furnish(folder, {"scenario.toml": SCENARIO.replace("count = 1", "count = 400").encode()})
    process = start(program, SIMULATE, folder)
    time.sleep(0.7)
    os.killpg(process.pid, signal.SIGINT)
    result = finish(process)
    wrong = [] if result.code in (0, 130) else [f"Ctrl-C ends with {result.code}"]
    if result.code == 130 and "same command" not in result.err:
        wrong.append(f"Ctrl-C does not say how to go on: {result.err[-200:]}")
    return wrong


@story
def read_only_folder(program, folder):
    if os.geteuid() == 0:
        return []
    furnish(folder)
    os.chmod(folder, 0o500)
    try:
        return ends(run(program, SIMULATE, folder), (1, 2), "read-only folder")
    finally:
        os.chmod(folder, 0o700)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", nargs="?", default=str(TREE / "target/release/catseye"))
    parser.add_argument("--only", help="cases whose name holds this")
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args()
    program = str(Path(options.program).resolve())
    tasks = [(c.name, lambda folder, c=c: one(program, c, folder)) for c in CASES]
    tasks += [(f.__name__.replace("_", " "), lambda folder, f=f: f(program, folder)) for f in SCENARIOS]
    if options.only:
        tasks = [t for t in tasks if options.only in t[0]]
    if options.list:
        print("\n".join(name for name, _ in tasks))
        return 0
    begin = time.monotonic()
    root = Path(tempfile.mkdtemp(prefix="hostile-"))

    def work(numbered):
        number, (name, function) = numbered
        folder = root / str(number)
        folder.mkdir()
        started = time.monotonic()
        try:
            wrong = function(folder)
        except Exception as e:  # the script's own fault is a failure as well
            wrong = [f"{name}: {type(e).__name__}: {e}"]
        shutil.rmtree(folder, ignore_errors=True)
        return name, wrong, time.monotonic() - started

    failed, slow = 0, []
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for name, wrong, seconds in pool.map(work, enumerate(tasks)):
            slow.append((seconds, name))
            if wrong:
                failed += 1
                print("\n".join(w.replace("\n", " | ") for w in wrong), flush=True)
    shutil.rmtree(root, ignore_errors=True)
    for seconds, name in sorted(slow, reverse=True)[:3]:
        print(f"slowest: {seconds:.1f} s {name}")
    print(f"hostile: {len(tasks) - failed} passed, {failed} failed, in {time.monotonic() - begin:.0f} s")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
