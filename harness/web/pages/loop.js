// A sampled loop with one command: its gain, crossings and margins, from the linear model of a plant. No page, no FMU.
//
// The plant is x' = A x + b u, y = C x. The controller runs every T seconds on the error e = r - y: v = K e with a row K of
// gains, then a filter
//
//     N(z) = (b0 + b1/z + b2/z^2)/(1 + a1/z + a2/z^2).
//
// Its command acts tau seconds after the measurement and is held until the next one acts: d whole cycles and rest seconds.
// With G(t) = int_0^t exp(A s) b ds the plant from command to command is (Astrom and Wittenmark, Computer-Controlled Systems, 2.4)
//
//     x[k+1] = exp(A T) x[k] + (G(T) - G(T - rest)) u[k-d-1] + G(T - rest) u[k-d],
//     L(z) = N(z) K C^ (z I - exp(A T))^-1 ((G(T) - G(T - rest)) z^(-d-1) + G(T - rest) z^-d),
//
// and the loop closes with u = -L u.
globalThis.SampledLoop = (() => {
  "use strict";

  const zeros = (n, m) => Array.from({ length: n }, () => new Float64Array(m));
  const times = (a, b) => {
    const n = a.length, inner = b.length, m = b[0].length, c = zeros(n, m);
    for (let i = 0; i < n; i++) for (let k = 0; k < inner; k++) {
      const factor = a[i][k];
      if (factor) for (let j = 0; j < m; j++) c[i][j] += factor * b[k][j];
    }
    return c;
  };
  const dot = (a, b) => a.reduce((sum, value, i) => sum + value * b[i], 0);
  const norm = (matrix) => Math.sqrt(matrix.reduce((sum, row) => sum + dot(row, row), 0));

  // An orthonormal basis of the span of the vectors v, A v, A^2 v, ...; what is left below 1e-11 of |A| is rounding.
  function krylov(A, vectors) {
    const limit = 1e-11 * (norm(A) || 1), basis = [], waiting = vectors.map((v) => [v, 1e-11 * Math.sqrt(dot(v, v))]);
    while (waiting.length) {
      const [first, least] = waiting.shift();
      let rest = first;
      for (let twice = 0; twice < 2; twice++) for (const q of basis) {
        const along = dot(q, rest);
        rest = rest.map((x, i) => x - along * q[i]);
      }
      const length = Math.sqrt(dot(rest, rest));
      if (!(length > least)) continue;
      const unit = rest.map((x) => x / length);
      basis.push(unit);
      waiting.push([A.map((row) => dot(row, unit)), limit]);
    }
    return basis;
  }

  /** The part of (A, b, C) that the input moves and the outputs show. */
  function minimal({ A, b, C }) {
    const onto = (basis, { A, b, C }) => {
      const images = basis.map((q) => A.map((row) => dot(row, q)));
      return { A: basis.map((q) => images.map((image) => dot(q, image))), b: basis.map((q) => dot(q, b)), C: C.map((row) => basis.map((q) => dot(row, q))) };
    };
    const moved = onto(krylov(A, [b]), { A, b, C }), transposed = moved.A.map((_, j) => moved.A.map((row) => row[j]));
    return onto(krylov(transposed, moved.C), moved);
  }

  // exp(A t) and int_0^t exp(A s) b ds, by scaling, Taylor's series and squaring.
  function held({ A, b }, t) {
    const n = b.length, whole = zeros(n + 1, n + 1);
    A.forEach((row, i) => row.forEach((value, j) => { whole[i][j] = value * t; }));
    b.forEach((value, i) => { whole[i][n] = value * t; });
    const halvings = Math.max(0, Math.ceil(Math.log2(norm(whole) / 0.25)));
    const small = whole.map((row) => row.map((x) => x / 2 ** halvings));
    let term = zeros(n + 1, n + 1), sum = zeros(n + 1, n + 1);
    for (let i = 0; i <= n; i++) term[i][i] = sum[i][i] = 1;
    for (let k = 1; k < 20; k++) {
      term = times(term, small).map((row) => row.map((x) => x / k));
      sum.forEach((row, i) => row.forEach((_, j) => { row[j] += term[i][j]; }));
    }
    for (let k = 0; k < halvings; k++) sum = times(sum, sum);
    return { step: sum.slice(0, n).map((row) => row.slice(0, n)), input: sum.slice(0, n).map((row) => row[n]) };
  }

  // Complex numbers as [re, im].
  const multiply = ([a, b], [c, d]) => [a * c - b * d, a * d + b * c];
  const divide = ([a, b], [c, d]) => { const s = c * c + d * d; return [(a * c + b * d) / s, (b * c - a * d) / s]; };
  const size = ([a, b]) => Math.hypot(a, b);

  // Solves (z I - A) x = right, real right, by Gaussian elimination with row pivots.
  function solve(A, z, right) {
    const n = A.length;
    const rows = A.map((row, i) => [...Array.from(row, (value, j) => (i === j ? [z[0] - value, z[1]] : [-value, 0])), [right[i], 0]]);
    for (let k = 0; k < n; k++) {
      let best = k;
      for (let i = k + 1; i < n; i++) if (size(rows[i][k]) > size(rows[best][k])) best = i;
      [rows[k], rows[best]] = [rows[best], rows[k]];
      for (let i = k + 1; i < n; i++) {
        const factor = divide(rows[i][k], rows[k][k]);
        for (let j = k; j <= n; j++) { const p = multiply(factor, rows[k][j]); rows[i][j] = [rows[i][j][0] - p[0], rows[i][j][1] - p[1]]; }
      }
    }
    const x = new Array(n);
    for (let i = n - 1; i >= 0; i--) {
      let sum = rows[i][n];
      for (let j = i + 1; j < n; j++) { const p = multiply(rows[i][j], x[j]); sum = [sum[0] - p[0], sum[1] - p[1]]; }
      x[i] = divide(sum, rows[i][i]);
    }
    return x;
  }

  // The largest magnitude of a matrix's eigenvalues: |A^(2^m)|^(2^-m), by squaring.
  function radius(matrix) {
    let power = matrix, logarithm = 0;
    const squarings = 36;
    for (let k = 0; k < squarings; k++) {
      const length = norm(power);
      if (!(length > 0)) return 0;
      logarithm += Math.log(length) / 2 ** k;
      power = power.map((row) => row.map((x) => x / length));
      power = times(power, power);
    }
    return Math.exp(logarithm + Math.log(norm(power) || 1) / 2 ** squarings);
  }

  // Roots of det(s I - A): coefficients by Faddeev and LeVerrier, zeros by Durand and Kerner. For the few states of one axis.
  function poles(A) {
    const n = A.length, scale = norm(A) || 1, a = A.map((row) => Float64Array.from(row, (x) => x / scale)), c = [1];
    let M = zeros(n, n);
    for (let k = 1; k <= n; k++) {
      M = times(a, M);
      for (let i = 0; i < n; i++) M[i][i] += c[k - 1];
      const am = times(a, M);
      c.push(-am.reduce((sum, row, i) => sum + row[i], 0) / k);
    }
    let roots = Array.from({ length: n }, (_, k) => { const p = 0.4 + (2 * Math.PI * k) / n; return [0.8 * Math.cos(p), 0.8 * Math.sin(p)]; });
    for (let round = 0; round < 300; round++) roots = roots.map((root, i) => {
      const value = c.reduce((sum, x) => { const p = multiply(sum, root); return [p[0] + x, p[1]]; }, [0, 0]);
      const below = roots.reduce((p, other, j) => (j === i ? p : multiply(p, [root[0] - other[0], root[1] - other[1] + 1e-300])), [1, 0]);
      const off = divide(value, below);
      return [root[0] - off[0], root[1] - off[1]];
    });
    return roots.map(([re, im]) => [re * scale, im * scale]);
  }

  /** A notch at the frequency f (Hz), 20 dB deep: zeros damped by a tenth of the poles' `width`; by Tustin's rule, exact at f. */
  function notch(f, width, period) {
    const w = 2 * Math.PI * f, k = w / Math.tan((w * period) / 2);
    const side = (zeta) => [k * k + 2 * zeta * w * k + w * w, 2 * (w * w - k * k), k * k - 2 * zeta * w * k + w * w];
    const [over, under] = [side(width / 10), side(width)];
    return { b: over.map((x) => x / under[0]), a: under.slice(1).map((x) => x / under[0]) };
  }
  const THROUGH = { b: [1, 0, 0], a: [0, 0] };

  /** A loop: plant {A, b, C}, gains of each measurement, filter, period and delay in s. */
  class Loop {
    constructor({ plant, gains, filter = THROUGH, period, delay }) {
      Object.assign(this, { plant, gains, filter, period, delay });
      this.row = plant.b.map((_, j) => gains.reduce((sum, gain, i) => sum + gain * plant.C[i][j], 0));
      const { step, input } = held(plant, period);
      this.step = step;
      this.full = input;
      const rest = this.cut(delay);
      this.cycles = rest.cycles;
      this.parts = rest.parts;
      this.poles = poles(plant.A).map(([re, im]) => [-re, Math.hypot(re, im)]);
    }

    // Whole cycles of a delay, and what the older and the newer command do in one.
    cut(delay) {
      const cycles = Math.floor(delay / this.period + 1e-9), part = delay / this.period - cycles;
      const rest = part > 1e-9 ? part * this.period : 0;
      const later = rest ? held(this.plant, this.period - rest).input : this.full;
      return { cycles, parts: [this.full.map((x, i) => x - later[i]), later] };
    }

    /** L at the angular frequency w, rad/s, as [re, im]. */
    gain(w) {
      const phase = w * this.period, power = (n) => [Math.cos(n * phase), Math.sin(n * phase)], z = power(1);
      const of = (right) => solve(this.step, z, right).reduce((sum, x, i) => [sum[0] + this.row[i] * x[0], sum[1] + this.row[i] * x[1]], [0, 0]);
      const [older, newer] = [multiply(of(this.parts[0]), power(-this.cycles - 1)), multiply(of(this.parts[1]), power(-this.cycles))];
      const { a, b } = this.filter, series = (c) => c.reduce((sum, x, i) => { const p = power(-i); return [sum[0] + x * p[0], sum[1] + x * p[1]]; }, [0, 0]);
      return multiply(divide(series(b), series([1, ...a])), [older[0] + newer[0], older[1] + newer[1]]);
    }

    /** The closed loop's largest |z|: below 1 it is stable. States: plant, commands on the way (the oldest first), filter. */
    largest(delay = this.delay) {
      const { cycles, parts } = delay === this.delay ? this : this.cut(delay), n = this.full.length, waiting = cycles + 1, last = n + waiting;
      const M = zeros(last + 2, last + 2), { a, b } = this.filter;
      // v = -row x, u = b0 v + s1, s1' = b1 v - a1 u + s2, s2' = b2 v - a2 u
      const v = new Float64Array(last + 2), u = new Float64Array(last + 2);
      this.row.forEach((x, j) => { v[j] = -x; u[j] = -b[0] * x; });
      u[last] = 1;
      for (let i = 0; i < n; i++) {
        M[i].set(this.step[i]);
        M[i][n] += parts[0][i];
        if (cycles) M[i][n + 1] += parts[1][i];
        else u.forEach((x, j) => { M[i][j] += parts[1][i] * x; });
      }
      for (let i = 0; i + 1 < waiting; i++) M[n + i][n + i + 1] = 1;
      M[last - 1].set(u);
      for (let k = 0; k < 2; k++) u.forEach((x, j) => { M[last + k][j] = b[k + 1] * v[j] - a[k] * x; });
      M[last][last + 1] += 1;
      return radius(M);
    }

    /** Points [w, L] so close that nothing lies between: L turns or grows by less than a tenth from one to the next. */
    curve() {
      const nyquist = Math.PI / this.period, low = 2 * Math.PI * 1e-3, high = nyquist * (1 - 1e-7);
      const nodes = Array.from({ length: 240 }, (_, i) => low * (high / low) ** (i / 239));
      for (const [decay, w] of this.poles) for (const k of [0, 0.3, 1, 3, 10, 30, 100]) for (const side of [-1, 1]) {
        const node = w + side * k * Math.max(Math.abs(decay), 1e-9 * w);
        if (node > low && node < high) nodes.push(node);
      }
      nodes.sort((a, b) => a - b);
      const points = [];
      const between = (a, b, depth) => {
        const ratio = divide(b[1], a[1]);
        if (depth && (Math.abs(Math.log(size(ratio))) > 0.1 || Math.abs(Math.atan2(ratio[1], ratio[0])) > 0.1)) {
          const w = (a[0] + b[0]) / 2, middle = [w, this.gain(w)];
          between(a, middle, depth - 1);
          between(middle, b, depth - 1);
        } else points.push(b);
      };
      let before = [nodes[0], this.gain(nodes[0])];
      points.push(before);
      for (const w of nodes.slice(1)) {
        if (w === before[0]) continue;
        const now = [w, this.gain(w)];
        between(before, now, 14);
        before = now;
      }
      return points;
    }

    /**
     * Stability and margins: `crossings` (kind "gain" where |L| = 1, "phase" where L is real and negative; frequency, Hz; gain
     * margin, dB; phase margin, deg), `gainMargins` (dB, by which the gain may shrink and grow), `phaseMargin` (deg), `delayMargin`
     * (s, by which the command may come later), `modulusMargin` (least distance of L to -1), and the `curve` of L.
     */
    margins() {
      const curve = this.curve(), crossings = [], nyquist = Math.PI / this.period;
      const kinds = { gain: ([re, im]) => Math.log(Math.hypot(re, im)), phase: (L) => L[1] / size(L) };
      for (const [kind, sign] of Object.entries(kinds)) for (let i = 1; i < curve.length; i++) {
        let [[low, one], [high, two]] = [curve[i - 1], curve[i]];
        if (sign(one) > 0 === sign(two) > 0) continue;
        for (let k = 0; k < 60 && high - low > 1e-14 * high; k++) {
          const middle = (low + high) / 2;
          if (sign(this.gain(middle)) > 0 === sign(one) > 0) low = middle; else high = middle;
        }
        const w = (low + high) / 2, L = this.gain(w);
        if (kind === "gain") crossings.push({ kind, frequency: w / (2 * Math.PI), phaseMargin: (Math.atan2(-L[1], -L[0]) * 180) / Math.PI });
        else if (L[0] < 0) crossings.push({ kind, frequency: w / (2 * Math.PI), gainMargin: -20 * Math.log10(size(L)) });
      }
      const end = this.gain(nyquist)[0]; // real there
      if (end < 0) crossings.push({ kind: "phase", frequency: nyquist / (2 * Math.PI), gainMargin: -20 * Math.log10(-end) });
      crossings.sort((a, b) => a.frequency - b.frequency);
      const away = ([, [re, im]]) => Math.hypot(1 + re, im);
      const least = curve.reduce((best, point, i) => (away(point) < away(curve[best]) ? i : best), 0);
      let [low, high] = [curve[Math.max(0, least - 1)][0], curve[Math.min(curve.length - 1, least + 1)][0]];
      const distance = (w) => away([w, this.gain(w)]);
      for (let k = 0; k < 60; k++) { // the golden section
        const part = 0.381966 * (high - low);
        if (distance(low + part) < distance(high - part)) high -= part; else low += part;
      }
      const all = (key) => crossings.filter((one) => one[key] !== undefined).map((one) => one[key]);
      const gains = all("gainMargin"), phases = all("phaseMargin"), stable = this.largest() < 1;
      return {
        stable, crossings, curve,
        gainMargins: [Math.max(-Infinity, ...gains.filter((x) => x < 0)), Math.min(Infinity, ...gains.filter((x) => x >= 0))],
        phaseMargin: phases.reduce((best, x) => (Math.abs(x) < Math.abs(best) ? x : best), Infinity),
        delayMargin: stable ? this.delayMargin(crossings) : 0,
        modulusMargin: distance((low + high) / 2),
      };
    }

    // By the crossing that a delay brings to -1 first; a sampled loop does so exactly at whole cycles, so it is sought about there.
    delayMargin(crossings) {
      const late = crossings.filter(({ kind }) => kind === "gain").map(({ frequency, phaseMargin }) => ((phaseMargin + 360) % 360) / 360 / frequency);
      const first = Math.min(Infinity, ...late);
      if (first === Infinity) return first;
      const unstable = (more) => this.largest(this.delay + more) >= 1;
      let low = 0, high = Math.max(0, first - 2 * this.period);
      while (!unstable(high)) {
        low = high;
        high += this.period / 2;
        if (high > 1.5 * first + 2 * this.period) return Infinity;
      }
      while (high - low > 1e-6 * high) {
        const middle = (low + high) / 2;
        if (unstable(middle)) high = middle; else low = middle;
      }
      return (low + high) / 2;
    }
  }

  return { Loop, notch, minimal, THROUGH };
})();
