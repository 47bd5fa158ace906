"""The radar cross section of a road marker over azimuth, beside the closed form of a plate."""

import sys

import numpy as np

import catseye

device = sys.argv[1] if len(sys.argv) > 1 else "auto"
azimuth_deg = np.arange(-45, 45.5, 0.5)
marker = catseye.reflector("type1:width_m=0.16,height_m=0.004,material=aluminium")
found = catseye.rcs(marker, frequency_hz=[76e9, 77e9], azimuth_deg=azimuth_deg, elevation_deg=1.0, engine=device)

hh = found.hh_dbsm[1, 0]
print(f"{marker}: S has axes [frequency, elevation, azimuth, rx, tx] = {found.s.shape}")
print(f"largest at 77 GHz: {hh.max():.2f} dBsm at {azimuth_deg[hh.argmax()]:.1f} deg")
print(f"median over +-45 deg: {np.median(hh):.2f} dBsm")

# A flat plate has sigma = 4 pi A^2 / lambda^2 on its normal.
plate = catseye.rcs("plate:width_m=0.1,height_m=0.05", engine=device).vv_dbsm[0, 0, 0]
exact = 10 * np.log10(4 * np.pi * (0.1 * 0.05) ** 2 / (299_792_458 / 77e9) ** 2)
print(f"plate: {plate:.3f} dBsm, closed form {exact:.3f} dBsm")
