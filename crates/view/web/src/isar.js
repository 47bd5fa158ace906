// An image of where echoes come from, from S over frequency and azimuth (inverse synthetic aperture).

const C = 299792458;

/** Extent and cells of the image that a table allows: steps give the extent without repetition, spans the cells. */
export function sizes(t) {
  const f = t.axes.frequency_hz, a = t.axes.azimuth_deg.map((d) => (d * Math.PI) / 180);
  const middle = 0.5 * (f[0] + f.at(-1));
  const step = (l) => (l.at(-1) - l[0]) / (l.length - 1);
  const dx_m = C / (2 * (f.at(-1) - f[0])), dy_m = C / (2 * middle * 2 * Math.sin(0.5 * Math.min(Math.PI, a.at(-1) - a[0])));
  return { dx_m, dy_m, x_m: C / (2 * step(f)), y_m: C / (2 * middle * step(a)), n: 96 };
}

/**
 * Levels in dB of |sum S w exp(-j 2 k (x cos a + y sin a))|, normalised by the sum of the weights w, so that a point of so many dBsm shows them;
 * Hann over both sweeps. Rows are x, columns y from the right (negative) to the left.
 */
export function image(t, elevation, { x_m, y_m, n }) {
  const f = t.axes.frequency_hz, a = t.axes.azimuth_deg;
  const hann = (list, v) => (list.length < 2 ? 1 : 0.5 - 0.5 * Math.cos((2 * Math.PI * (list.indexOf(v) + 0.5)) / list.length));
  const re = new Float64Array(n * n), im = new Float64Array(n * n);
  let sum = 0;
  const cos_e = Math.cos((elevation * Math.PI) / 180);
  const [ur, ui, vr, vi] = [0, 0, 0, 0].map(() => new Float64Array(n));
  for (let i = 0; i < t.frequency_hz.length; i++) {
    if (t.elevation_deg[i] !== elevation || !Number.isFinite(t.vv_re_m[i])) continue;
    const w = hann(f, t.frequency_hz[i]) * hann(a, t.azimuth_deg[i]);
    sum += w;
    const k2 = (4 * Math.PI * t.frequency_hz[i] * cos_e) / C, angle = (t.azimuth_deg[i] * Math.PI) / 180;
    // The phase of a pixel is that of its row times that of its column.
    for (let p = 0; p < n; p++) {
      const at = (p + 0.5) / n - 0.5;
      const px = -k2 * Math.cos(angle) * at * x_m, py = -k2 * Math.sin(angle) * at * y_m;
      ur[p] = Math.cos(px); ui[p] = Math.sin(px); vr[p] = Math.cos(py); vi[p] = Math.sin(py);
    }
    const sr = w * t.vv_re_m[i], si = w * t.vv_im_m[i];
    for (let r = 0; r < n; r++) {
      const br = sr * ur[r] - si * ui[r], bi = sr * ui[r] + si * ur[r];
      for (let c = 0, k = r * n; c < n; c++, k++) {
        re[k] += br * vr[c] - bi * vi[c];
        im[k] += br * vi[c] + bi * vr[c];
      }
    }
  }
  // sigma = 4 pi |S|^2.
  return Float64Array.from(re, (x, k) => 10 * Math.log10((4 * Math.PI * (x * x + im[k] * im[k])) / (sum * sum) + 1e-30));
}
