"""Writes cube_h5py.h5: cubes as h5py stores them. Run with h5py 3.16, numpy 2.4."""

import h5py
import numpy as np

chirp, rx, sample = np.meshgrid(np.arange(3), np.arange(2), np.arange(5), indexing="ij")
cube = (1000 * chirp + 100 * rx + sample) / 8 - 1j * (chirp - rx + 10 * sample) / 16
with h5py.File("cube_h5py.h5", "w") as f:
    f.create_dataset("complex64", data=cube.astype("complex64"))
    f.create_dataset("complex128", data=cube, chunks=(1, 2, 3), compression="gzip", shuffle=True)
    f.create_dataset("big_endian", data=cube.astype(">c8"))
    f.create_dataset("group/i", data=np.rint(8 * cube.real).astype("int16"))
    f.create_dataset("group/q", data=np.rint(16 * cube.imag).astype("float32"))
    f.create_dataset("iq_last", data=np.stack([8 * cube.real, 16 * cube.imag], -1).astype("<i2"))
    f.create_dataset("sample_first", data=cube.transpose(2, 0, 1).astype("complex64"))
