"""One frame of the built-in marked road, from the scene to points."""

import sys

import numpy as np

import catseye

device = sys.argv[1] if len(sys.argv) > 1 else "auto"
scenario = catseye.Scenario.parse(
    """
    name = "first frame"
    seed = 1
    radar = "demo77"
    [scene]
    builtin = "marked-road"
    [ego]
    position_m = [0, 0, 0]
    speed_mps = 10
    """
)
engine = catseye.Engine(device)
print(engine.description)
frame = next(catseye.simulate(scenario, engine=engine))

print("samples", frame.adc.shape, frame.adc.dtype)
peak = np.unravel_index(np.argmax(frame.range_doppler), frame.range_doppler.shape)
print(f"strongest cell at {frame.range_m[peak[1]]:.1f} m, {frame.range_rate_mps[peak[0]]:.1f} m/s")
for point in frame.points[:5]:
    print(
        f"{point['class'] or 'unknown':10} {point['range_m']:6.2f} m {point['range_rate_mps']:6.2f} m/s "
        f"{point['azimuth_deg']:6.1f} deg {point['rcs_dbsm']:6.1f} dBsm"
    )
