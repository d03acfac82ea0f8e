// Plays a run: moves the objects of the scene by the rows of the table, and the cursor of the plots to the same time.
(() => {
  "use strict";
  const run = JSON.parse(document.getElementById("run").textContent);
  const at = (id) => document.getElementById(id);

  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const floats = (text) => new Float32Array(bytes(text));
  const columns = Object.fromEntries(Object.entries(run.columns).map(([name, text]) => [name, floats(text)]));
  const count = run.time.count;
  const listed = run.time.times ? new Float64Array(bytes(run.time.times)) : null;
  const timeOf = (k) => (listed ? listed[k] : run.time.first + run.time.step * k);
  const first = timeOf(0), last = timeOf(count - 1);

  // Returns the last row at or before t, and the fraction of the way from this row to the next at which t is.
  function place(t) {
    let k;
    if (listed) {
      let [low, high] = [0, count - 1];
      while (high - low > 1) { const middle = (low + high) >> 1; if (listed[middle] <= t) low = middle; else high = middle; }
      k = low;
    } else k = Math.floor((t - first) / run.time.step + 1e-6);
    k = Math.max(0, Math.min(count - 2, k));
    const part = (t - timeOf(k)) / (timeOf(k + 1) - timeOf(k));
    return [k, part < 1e-5 ? 0 : part > 1 - 1e-5 ? 1 : part];
  }

  const value = (name, [k, part]) => {
    const column = columns[name];
    return part === 0 ? column[k] : part === 1 ? column[k + 1] : column[k] + (column[k + 1] - column[k]) * part;
  };

  // Returns directions from hinges to pendulum masses: recorded, or from slosh angles, whose sines are displacements divided by the length.
  function direction(mode, where) {
    if (mode.p) {
      const p = mode.p.map((name) => value(name, where)), size = Math.hypot(...p);
      return p.map((x) => x / size);
    }
    const [a, b] = mode.angles.map((name) => (name ? value(name, where) : 0));
    const [x, y] = [Math.sin(a), Math.sin(b)];
    return [x, y, -Math.sign(Math.cos(a) * Math.cos(b)) * Math.sqrt(Math.max(0, 1 - x * x - y * y))];
  }

  // Returns the surface shape of a mode by linear interpolation over the mass of liquid.
  function surface({ liquid, masses, shapes }, n, where) {
    const last = masses.length - 1, found = masses.findIndex((m) => m >= value(liquid, where));
    if (last === 0) return shapes[0][n];
    const k = found < 0 ? last : Math.max(1, found), [a, b] = [shapes[k - 1][n], shapes[k][n]];
    const part = (value(liquid, where) - masses[k - 1]) / (masses[k] - masses[k - 1]);
    return a.map((one, i) => one + (b[i] - one) * part);
  }

  function stateAt(t) {
    const where = place(t), state = { arrows: {} };
    if (run.motion.theta) {
      const theta = value(run.motion.theta, where);
      state.q = [Math.cos(theta / 2), 0, 0, Math.sin(theta / 2)];
      // the speed of the rotor is relative to the ground
      if (run.motion.wheel) state.wheel = value(run.motion.wheel, where) - theta;
    } else if (run.motion.q) state.q = run.motion.q.map((name) => value(name, where));
    state.tanks = run.tanks.map((tank, i) => {
      const drawn = { p: tank.modes.map((mode) => direction(mode, where)) };
      if (tank.level) {
        drawn.level = value(tank.level, where);
        drawn.modes = tank.modes.map((mode) => ({ length: value(mode.length, where), hinge: value(mode.hinge, where) }));
        if (tank.surfaces) drawn.modes.forEach((mode, n) => { mode.shape = surface(tank.surfaces, n, where); });
      }
      return drawn;
    });
    for (const [name, source] of Object.entries(run.scene.arrows)) {
      const one = (n) => (typeof n === "number" ? n : value(n, where));
      state.arrows[name] = Array.isArray(source) ? [...source.map(one), 0].slice(0, 3) : one(source);
    }
    return state;
  }

  let scene = null;
  try {
    scene = HubSloshScene.create(at("scene"), run.scene.geometry);
  } catch (error) {
    const text = document.createElement("p");
    text.className = "none";
    text.textContent = `${error.message}. The plots show the run.`;
    at("scene").append(text);
  }

  // Plots in the light or dark scheme of the reader, with envelopes as fine as the width of the plot allows.
  const dark = matchMedia("(prefers-color-scheme: dark)");
  // A quantity with an arrow in the scene has the colour of its arrow; other curves take colours that are still free.
  const arrowOf = new Map(Object.entries(run.scene.arrows).filter(([, source]) => typeof source === "string").map(([arrow, column]) => [column, arrow]));
  function colorsOf(names) {
    const fixed = names.map((name) => scene && scene.colors[arrowOf.get(name)]);
    const all = HubSloshScene.ARROWS[dark.matches ? "dark" : "light"];
    const free = all.filter((color) => !fixed.includes(color));
    return fixed.map((color, i) => color || free.shift() || all[i % all.length]);
  }
  const plots = run.panels.map((panel, i) => {
    const box = document.createElement("div"), head = document.createElement("p"), place = document.createElement("div"), cursor = document.createElement("div");
    box.className = "panel";
    place.className = "plot";
    cursor.className = "cursor";
    const title = document.createElement("b");
    title.textContent = panel.unit && panel.unit !== "1" ? `${panel.title} / ${panel.unit}` : panel.title;
    head.append(title);
    const shown = panel.names.map((name) => {
      const span = document.createElement("span"), swatch = document.createElement("i"), text = document.createElement("span");
      span.append(swatch, text);
      head.append(span);
      return { name, swatch, text };
    });
    box.append(head, place, cursor);
    at("plots").append(box);
    const envelopes = panel.names.map((name) => {
      const e = run.envelopes[name];
      return e && { times: floats(e.times), low: floats(e.low), high: floats(e.high), each: e.each };
    });
    return { panel, place, cursor, shown, envelopes, last: i === run.panels.length - 1 };
  });

  // Returns the points of a curve between two times: all points, or the smallest and the largest in each visible interval.
  const INTERVALS = 700;
  function line(plot, i, from, to) {
    const envelope = plot.envelopes[i], x = [], y = [];
    const put = (t, low, high, turn) => { if (low === high) { x.push(t); y.push(low); } else { x.push(t, t); y.push(turn ? high : low, turn ? low : high); } };
    const column = columns[plot.shown[i].name];
    const times = envelope ? (k) => envelope.times[k] : timeOf;
    const [low, high] = envelope ? [envelope.low, envelope.high] : [column, column];
    const n = low.length;
    let start = 0, end = n;
    while (start < n - 1 && times(start + 1) < from) start++;
    while (end > start + 1 && times(end - 2) > to) end--;
    const each = Math.max(1, Math.ceil((end - start) / INTERVALS));
    for (let k = start, turn = false; k < end; k += each, turn = !turn) {
      let least = Infinity, most = -Infinity;
      for (let j = k; j < Math.min(k + each, end); j++) { least = Math.min(least, low[j]); most = Math.max(most, high[j]); }
      put(times(k), least, most, turn);
    }
    return [x, y];
  }

  let window_ = [first, last];
  function drawPlots() {
    const night = dark.matches, ink = night ? "#e6eaee" : "#1b1f24", rule = night ? "#2f3740" : "#dfe4e8";
    for (const plot of plots) {
      const colors = colorsOf(plot.panel.names);
      const traces = plot.shown.map(({ name, swatch }, i) => {
        const color = colors[i];
        swatch.style.background = color;
        const [x, y] = line(plot, i, ...window_);
        return { type: "scatter", mode: "lines", x, y, name, line: { width: 1.2, color } };
      }).reverse(); // the first curve is drawn on top
      Plotly.react(plot.place, traces, {
        margin: { l: 58, r: 8, t: 4, b: plot.last ? 34 : 6 }, showlegend: false, dragmode: "zoom", hovermode: false,
        paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { family: "system-ui, sans-serif", size: 11, color: ink },
        xaxis: { range: window_, gridcolor: rule, zeroline: false, showticklabels: plot.last, nticks: 7, title: plot.last ? { text: "time / s", standoff: 4 } : undefined },
        yaxis: { gridcolor: rule, zerolinecolor: rule, nticks: 4, fixedrange: true, exponentformat: "power" },
      }, { displayModeBar: false, responsive: true, doubleClick: false });
    }
    moveCursors();
  }

  function moveCursors() {
    for (const { place, cursor } of plots) {
      const layout = place._fullLayout;
      if (!layout) continue;
      const { l, t } = layout._size, x = layout.xaxis.d2p(now);
      cursor.hidden = x < 0 || x > layout.xaxis._length;
      cursor.style.transform = `translateX(${place.offsetLeft + l + x}px)`;
      cursor.style.top = `${place.offsetTop + t}px`;
      cursor.style.height = `${layout._size.h}px`;
    }
  }

  // A click moves the cursor to its time; a drag is plotly's zoom.
  for (const { place } of plots) {
    let down = null;
    place.addEventListener("pointerdown", (event) => { down = [event.clientX, event.clientY]; }, true);
    place.addEventListener("click", (event) => {
      const layout = place._fullLayout;
      if (!down || !layout || Math.hypot(event.clientX - down[0], event.clientY - down[1]) > 4) return;
      seek(layout.xaxis.p2d(event.clientX - place.getBoundingClientRect().left - layout._size.l));
    }, true);
  }
  const relayout = (event) => {
    const range = event["xaxis.range"] || [event["xaxis.range[0]"], event["xaxis.range[1]"]];
    if (!Number.isFinite(Number(range[0]))) return;
    window_ = [Math.max(first, Number(range[0])), Math.min(last, Number(range[1]))];
    at("window").value = "";
    drawPlots();
  };
  const all = () => { at("window").value = ""; window_ = [first, last]; drawPlots(); };
  // Plots of a part of the run move on by a part when the time leaves it.
  function turnPage() {
    const width = Math.min(Number(at("window").value), last - first);
    if (!width || (now >= window_[0] && now <= window_[1] && Math.abs(window_[1] - window_[0] - width) < 1e-6 * width)) return;
    const start = Math.max(first, Math.min(last - width, now - 0.1 * width));
    window_ = [start, start + width];
    drawPlots();
  }

  // Time
  let now = first, playing = false, before = 0;
  const speed = () => 10 ** Number(at("speed").value);
  const short = (x) => Number(x.toPrecision(2)).toString();
  const places = Math.max(0, Math.min(4, Math.ceil(-Math.log10((last - first) / 2e4))));

  function show() {
    const where = place(now);
    at("time").value = String((1000 * (now - first)) / (last - first));
    at("time").setAttribute("aria-valuetext", `${now.toFixed(places)} s`);
    at("now").textContent = `${now.toFixed(places)} s`;
    if (scene) scene.show(stateAt(now));
    for (const plot of plots) plot.shown.forEach(({ name, text }, i) => {
      const envelope = plot.envelopes[i];
      // a column that is kept only as an envelope has values only if it keeps every row
      const known = columns[name] ? value(name, where) : envelope.each === 1 ? envelope.low[Math.min(nearest(envelope.times), envelope.low.length - 1)] : null;
      // the name in the title of the panel is not repeated
      const title = plot.panel.title, tank = title.slice(0, title.lastIndexOf(".") + 1);
      const label = name.startsWith(title) ? name.slice(title.length) || "now" : name.slice(name.startsWith(tank) ? tank.length : 0);
      text.textContent = known === null ? label : `${label} = ${HubSloshScene.digits(known)}`;
    });
    turnPage();
    moveCursors();
  }

  function nearest(times) {
    let [low, high] = [0, times.length - 1];
    while (high - low > 1) { const middle = (low + high) >> 1; if (times[middle] <= now + 1e-9) low = middle; else high = middle; }
    return now - times[low] > times[high] - now ? high : low;
  }

  function seek(t) {
    now = Math.max(first, Math.min(last, t));
    show();
  }

  function step(stamp) {
    if (!playing) return;
    const passed = Math.min(0.1, (stamp - before) / 1000);
    before = stamp;
    now += passed * speed();
    if (now >= last) { now = last; play(false); }
    show();
    requestAnimationFrame(step);
  }

  function play(on) {
    playing = on;
    at("play").textContent = on ? "❚❚" : "▶";
    at("play").setAttribute("aria-label", on ? "Pause" : "Play");
    if (!on) return;
    if (now >= last) now = first;
    before = performance.now();
    requestAnimationFrame(step);
  }

  const setSpeed = () => { at("speed-is").textContent = `${short(speed())} ×`; };
  const setWave = () => {
    const times = 10 ** Number(at("wave").value);
    at("wave-is").textContent = short(times);
    if (scene) scene.exaggeration = times;
  };
  const setFrame = () => { if (scene && at("body")) scene.frame = at("body").checked ? "body" : "inertial"; };

  at("play").addEventListener("click", () => play(!playing));
  at("time").addEventListener("input", () => seek(first + (Number(at("time").value) / 1000) * (last - first)));
  at("speed").addEventListener("input", setSpeed);
  at("wave").addEventListener("input", setWave);
  at("body")?.addEventListener("change", setFrame);
  at("window").addEventListener("change", () => (at("window").value ? turnPage() : all()));

  const row = (by) => {
    const [k, part] = place(now), here = part === 1 ? k + 1 : k;
    play(false);
    seek(timeOf(Math.max(0, Math.min(count - 1, here + by + (by < 0 && part > 0 && part < 1 ? 1 : 0)))));
  };
  document.addEventListener("keydown", (event) => {
    const own = event.target.closest?.("input[type=range], summary") && event.target.id !== "time";
    if (event.ctrlKey || event.metaKey || event.altKey || own) return;
    const many = event.shiftKey ? 10 : 1;
    switch (event.key) {
      case " ": if (event.target.id === "play" || event.target.id === "body") return; play(!playing); break;
      case "ArrowLeft": row(-many); break;
      case "ArrowRight": row(many); break;
      case "Home": seek(first); break;
      case "End": seek(last); break;
      case ",": case "<": at("speed").value = String(Number(at("speed").value) - 0.1); setSpeed(); break;
      case ".": case ">": at("speed").value = String(Number(at("speed").value) + 0.1); setSpeed(); break;
      case "b": if (at("body")) { at("body").checked = !at("body").checked; setFrame(); } break;
      default: return;
    }
    event.preventDefault();
  });

  setSpeed();
  setWave();

  for (const option of [...at("window").options]) if (Number(option.value) > 0.6 * (last - first)) option.remove();
  show();
  // the scene is drawn before the plots
  requestAnimationFrame(() => setTimeout(() => {
    drawPlots();
    plots.forEach(({ place }) => { place.on("plotly_relayout", relayout); place.addEventListener("dblclick", all); });
    dark.addEventListener("change", drawPlots);
    new ResizeObserver(moveCursors).observe(at("plots"));
    document.documentElement.dataset.drawn = "yes";
  }));
  // For tests and screen recordings: sets the time, and returns the state of the page.
  globalThis.hubsloshView = { seek, first, last, timeOf, count, read: () => scene && scene.read(), scene, get now() { return now; }, get playing() { return playing; } };
})();
