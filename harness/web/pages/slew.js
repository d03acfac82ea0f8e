// The live page "Slew": a spacecraft with two tanks turns under a sampled controller; beside it the margins of its loops.
(() => {
  "use strict";
  const { make, print, button, Settings, Plot } = Live;
  const PERIOD = 0.1; // of the controller's cycle, s
  const END = 150; // of a run, s
  const LOST = 90; // a pointing error that ends a run, degrees
  const BUDGET = 12; // ms of a frame for the plant
  const KEPT = 4; // traces of earlier runs
  const XI = 1.8411837813406593; // first zero of J1'
  const DEGREES = 180 / Math.PI;
  const AXES = ["x", "y", "z"];
  // The dry craft, kg and kg·m²; two upright cylinders of water-like propellant, m and kg/m³.
  const CRAFT = { "craft.mass": 430, "craft.Jxx": 95, "craft.Jyy": 80, "craft.Jzz": 90 };
  const TANK = { radius: 0.35, side: 0.6, bottom: -0.35, density: 1008 };
  const list = (name, n = 3) => Array.from({ length: n }, (_, i) => `${name}[${i + 1}]`);
  const MEASURED = [...list("q", 4), ...list("omega")];
  const READ = [...MEASURED, ...list("slosh_torque"), ...[1, 2].flatMap((n) => [1, 2, 3].map((i) => `tank[${n}].p[1,${i}]`)), "tank[1].wave_height", "tank[2].wave_height"];

  const SETTINGS = [
    { key: "bandwidth", label: "Bandwidth", min: 0.005, max: 0.15, step: 0.001, start: 0.03, unit: "Hz", digits: 3 },
    { key: "ratio", label: "Damping ratio", min: 0.2, max: 1.5, step: 0.05, start: 0.7, unit: "", digits: 2 },
    { key: "delay", label: "Delay", min: 0, max: 4, step: 0.05, start: 0.15, unit: "s", digits: 2 },
    { key: "notch", label: "Notch", start: "off", options: [["off", "none"], ["on", "20 dB deep"]] },
    { key: "center", label: "Notch at", min: 0.03, max: 0.5, step: 0.001, start: 0.105, unit: "Hz", digits: 3 },
    { key: "width", label: "Notch width", min: 0.1, max: 1, step: 0.05, start: 0.4, unit: "", digits: 2 },
    { key: "axis", label: "Turn about", start: "z", options: [["x", "x, across the thrust"], ["y", "y, the tanks' arm"], ["z", "z, the thrust"]] },
    { key: "angle", label: "Angle", min: 5, max: 90, step: 5, start: 30, unit: "°", digits: 0 },
    { key: "duration", label: "In", min: 10, max: 80, step: 1, start: 30, unit: "s", digits: 0 },
    { key: "thrust", label: "Thrust", min: 10, max: 200, step: 2, start: 44, unit: "N", digits: 0 },
    { key: "fill", label: "Liquid's depth", min: 100, max: 600, step: 10, start: 280, unit: "mm", digits: 0 },
    { key: "zeta", label: "Slosh damping", min: 0.0005, max: 0.05, step: 0.0005, start: 0.0085, unit: "%", digits: 2, scale: 0.01 },
    { key: "speed", label: "Speed", min: 1, max: 40, step: 1, start: 10, unit: "×", digits: 0 },
  ];

  // What is left to turn, as the vector part of q^-1 r: half the angle about each body axis, the short way round.
  function errorOf(q, r) {
    const sign = q[0] * r[0] + q[1] * r[1] + q[2] * r[2] + q[3] * r[3] < 0 ? -1 : 1;
    return [
      sign * (q[0] * r[1] - q[1] * r[0] - q[2] * r[3] + q[3] * r[2]),
      sign * (q[0] * r[2] + q[1] * r[3] - q[2] * r[0] - q[3] * r[1]),
      sign * (q[0] * r[3] - q[1] * r[2] + q[2] * r[1] - q[3] * r[0]),
    ];
  }

  class Slew extends Live.Page {
    constructor(fmu, element) {
      super();
      this.fmu = fmu;
      this.settings = new Settings(SETTINGS, (key) => this.changed(key));
      this.running = !Live.still();
      this.error = new Plot({ x: { range: [0, END], step: 30, digits: 0, label: "time, s" }, y: "pointing error, m°", most: 100, signed: true, label: "Pointing error against time",
        caption: "What is left to turn to the reference, about the slew's axis, in millidegrees. Faint: earlier settings. Dotted: now." });
      this.bode = new Plot({ x: { range: [0.005, 1], log: true, label: "frequency, Hz" }, y: "loop gain, dB", range: [-40, 40], label: "Loop gain against frequency",
        caption: "Gain of the loop about the slew's axis. Dots: where it is 0 dB (blue), and where its phase is −180° (orange): there its distance below 0 dB is a gain margin." });
      this.build(element);
      this.restart();
      requestAnimationFrame((time) => this.frame(time));
    }

    build(element) {
      this.place = make("div", { class: "live-scene" });
      this.says = make("p", { class: "live-says" });
      this.news = make("p", { class: "live-news", role: "status" });
      this.table = make("tbody");
      this.run = button("Run", () => {
        if (this.over) this.restart();
        this.running = !this.running;
        this.mark();
      });
      const anew = button("From rest", () => { this.restart(); this.running = true; this.mark(); });
      const clear = button("Clear plot", () => { this.error.clear(); this.traces = []; this.restart(); });
      const heads = ["about", "closed loop", "gain margins, dB", "phase margin", "delay margin", "modulus margin"];
      const margins = make("table", { class: "live-table" }, make("caption", {}, "Margins, each loop broken at its torque"),
        make("thead", {}, make("tr", {}, ...heads.map((text) => make("th", { scope: "col" }, text)))), this.table);
      element.append(
        make("div", { class: "live-top" }, this.place, make("div", { class: "live-plots" }, this.error.figure, this.bode.figure)),
        make("div", { class: "live-run", role: "group", "aria-label": "Run" }, this.run, anew, clear),
        this.says, this.news, make("div", { class: "live-wide", tabindex: 0, role: "region", "aria-label": "Margins" }, margins), this.settings.element,
      );
      this.mark();
    }

    mark() { this.run.textContent = this.running ? "Pause" : "Run"; }

    changed(key) {
      if (key === "speed") return;
      const was = this.over;
      this.restart();
      if (was) this.running = !Live.still();
      this.mark();
    }

    // What the FMU is given, as parameters and inputs.
    get parameters() {
      const { fill, zeta, thrust } = this.settings.values;
      const tanks = [1, -1].flatMap((side, n) => Object.entries({
        "position[2]": side * TANK.side, "position[3]": TANK.bottom, diameter: 2 * TANK.radius, depth: fill / 1000,
        density: TANK.density, "zeta[1]": zeta, g_ref: thrust / this.mass,
      }).map(([name, value]) => [`tank[${n + 1}].${name}`, value]));
      return { ...CRAFT, tanks: 2, ...Object.fromEntries(tanks), ...Object.fromEntries(list("init.omega").map((name) => [name, 0])), "force[3]": thrust };
    }

    get mass() {
      return CRAFT["craft.mass"] + 2 * TANK.density * Math.PI * TANK.radius ** 2 * (this.settings.values.fill / 1000);
    }

    // A new instance at rest, the controller and its margins, with the settings as they are.
    restart() {
      const { bandwidth, ratio, notch, center, width } = this.settings.values;
      this.plant?.free();
      this.plant = this.fmu.instantiate();
      this.plant.set(this.parameters);
      this.plant.initialize();
      this.cycle = this.time = 0;
      this.over = false;
      this.worst = this.settled = 0;
      const w = 2 * Math.PI * bandwidth;
      this.inertia = this.plant.get([1, 2, 3].map((i) => `inertia[${i},${i}]`));
      this.gains = this.inertia.map((J) => [2 * w * w * J, 2 * ratio * w * J]); // of half angles and rates
      this.filter = notch === "on" ? SampledLoop.notch(center, width, PERIOD) : SampledLoop.THROUGH;
      this.kept = AXES.map(() => [0, 0]); // the filters' states
      this.waiting = [];
      this.torque = [0, 0, 0];
      this.trace();
      this.margins();
      this.draw();
      this.present();
    }

    // A new line in the plot; older ones fade.
    trace() {
      this.traces ??= [];
      const last = this.traces.at(-1);
      if (last && last.points.length < 30) { last.drop(); this.traces.pop(); }
      this.traces.forEach((line) => line.fade());
      while (this.traces.length > KEPT) this.traces.shift().drop();
      this.traces.push(this.error.line("up"));
    }

    // The loops about the axes, each alone: the craft has two planes of symmetry, so no axis moves another.
    loops() {
      const n = AXES.length, { A, B, C } = this.fmu.linearize(this.parameters, list("torque"), [...list("omega"), "q[2]", "q[3]", "q[4]"]);
      return AXES.map((_, axis) => {
        const plant = SampledLoop.minimal({ A, b: B.map((row) => row[axis]), C: [C[n + axis], C[axis]] });
        return new SampledLoop.Loop({ plant, gains: this.gains[axis], filter: this.filter, period: PERIOD, delay: this.settings.values.delay });
      });
    }

    margins() {
      this.found = this.loops().map((loop) => loop.margins());
      const signed = (x) => (Number.isFinite(x) ? `${x > 0 ? "+" : ""}${print(x, 1)}` : x > 0 ? "no limit up" : "no limit down");
      this.table.replaceChildren(...this.found.map((m, axis) => make("tr", axis === this.axis ? { class: "chosen" } : {},
        make("th", { scope: "row" }, AXES[axis]),
        ...[m.stable ? "stable" : "UNSTABLE", m.gainMargins.map(signed).join(", "), Number.isFinite(m.phaseMargin) ? `${print(m.phaseMargin, 1)}°` : "none",
          Number.isFinite(m.delayMargin) ? `${print(m.delayMargin, 2)} s` : "no limit", print(m.modulusMargin, 2)].map((text) => make("td", {}, text)))));
      const { curve, crossings } = this.found[this.axis], decibel = (L) => 20 * Math.log10(Math.hypot(...L));
      const shown = curve.map(([w, L]) => [w / (2 * Math.PI), decibel(L)]).filter(([f]) => f >= 0.005 && f <= 1);
      const dots = crossings.filter(({ frequency: f }) => f >= 0.005 && f <= 1)
        .map(({ kind, frequency, gainMargin }) => [frequency, kind === "gain" ? 0 : -gainMargin, kind]);
      this.bode.draw("up", shown, dots);
      const unstable = AXES.filter((_, axis) => !this.found[axis].stable);
      this.news.textContent = unstable.length ? `The loop about ${unstable.join(" and ")} is unstable.` : "All loops are stable.";
    }

    get axis() { return AXES.indexOf(this.settings.values.axis); }

    // The picture: the box has the dry craft's mass and moments of inertia.
    draw() {
      const { fill, thrust } = this.settings.values, depth = fill / 1000, u = (XI * depth) / TANK.radius;
      // length and hinge of the first mode in an upright cylinder (NASA SP-106)
      const length = TANK.radius / (XI * Math.tanh(u)), hinge = depth - (TANK.radius / XI) * (Math.tanh(u / 2) - 1 / Math.sinh(u));
      const [Jx, Jy, Jz] = ["x", "y", "z"].map((i) => CRAFT[`craft.J${i}${i}`]), side = (more, less) => Math.sqrt((6 * (more - less)) / CRAFT["craft.mass"]);
      const key = JSON.stringify([fill, thrust]);
      if (key === this.drawn) return;
      this.drawn = key;
      this.scene?.dispose();
      const reach = TANK.side + TANK.radius, most = 2;
      const torque = (name, label, at) => ({ name, label, unit: "N·m", kind: "torque", most, length: 0.9, at });
      this.scene = HubSloshScene.create(this.place, {
        reach, radius: 1.35 * reach, target: [0, 0, 0.05], from: [1, -0.7, 0.6],
        body: { size: [side(Jy + Jz, Jx), side(Jx + Jz, Jy), side(Jx + Jy, Jz)], center: [0, 0, 0] },
        axes: { length: 0.85 * reach },
        tanks: [1, -1].map((sign) => ({
          position: [0, sign * TANK.side, TANK.bottom], level: depth,
          shape: { contour: HubSloshScene.cylinder(TANK.radius, 0, 0.75) },
          modes: [{ hinge, length, mass: 1, wave: (2 * TANK.radius) / (XI * XI - 1) }],
        })),
        arrows: [
          torque("torque", "torque", [0, 0, 0]), torque("slosh_torque", "liquid's torque", [0, 0, 0]),
          { name: "thrust", label: "thrust", unit: "N", kind: "force", most: 200, length: 0.9, at: [0, 0, -0.5], tip: true },
        ],
      }, { label: "Spacecraft with two tanks in three dimensions. Arrow keys turn the view, plus and minus zoom, 0 shows all." });
    }

    // The reference at a time: the acceleration is one period of a sine. Quaternion, rate and acceleration about the axis.
    reference(time) {
      const { angle, duration } = this.settings.values, whole = angle / DEGREES, w = (2 * Math.PI) / duration;
      const t = Math.min(time, duration), turned = (whole * (t - Math.sin(w * t) / w)) / duration;
      const q = [Math.cos(turned / 2), 0, 0, 0];
      q[this.axis + 1] = Math.sin(turned / 2);
      return { q, rate: (whole * (1 - Math.cos(w * t))) / duration, acceleration: (whole * w * Math.sin(w * t)) / duration };
    }

    // What the controller commands of measurements at the beginning of a cycle, N·m.
    command(measured) {
      const wanted = this.reference(this.cycle * PERIOD), half = errorOf(measured.slice(0, 4), wanted.q), { a, b } = this.filter;
      this.off = half.map((x) => 2 * Math.asin(Math.max(-1, Math.min(1, x))) * DEGREES);
      return AXES.map((_, i) => {
        const slewed = i === this.axis, rate = (slewed ? wanted.rate : 0) - measured[4 + i];
        const v = this.gains[i][0] * half[i] + this.gains[i][1] * rate, s = this.kept[i], u = b[0] * v + s[0];
        this.kept[i] = [b[1] * v - a[0] * u + s[1], b[2] * v - a[1] * u];
        return u + (slewed ? this.inertia[i] * wanted.acceleration : 0);
      });
    }

    // One cycle of the controller; within it the command changes where the delay says.
    step() {
      const { delay } = this.settings.values, begin = this.cycle * PERIOD, end = (this.cycle + 1) * PERIOD;
      const whole = Math.floor(delay / PERIOD + 1e-9), part = delay / PERIOD - whole, rest = part > 1e-9 ? part * PERIOD : 0;
      this.waiting.push(this.command([...this.plant.reals(MEASURED)]));
      const error = 1000 * this.off[this.axis];
      if (this.cycle % 2 === 0) this.traces.at(-1).add(begin, error);
      const size = 1000 * Math.hypot(...this.off);
      if (begin >= this.settings.values.duration) this.worst = Math.max(this.worst, size);
      if (size > 10) this.settled = begin;
      const next = this.waiting.length > whole ? this.waiting.shift() : [0, 0, 0];
      if (rest) this.advance(begin, rest);
      this.torque = next;
      this.plant.set(Object.fromEntries(next.map((value, i) => [`torque[${i + 1}]`, value])));
      this.advance(begin + rest, end - begin - rest);
      this.cycle += 1;
      this.time = end;
      if (Math.hypot(...this.off) > LOST) throw new Error(`it is ${LOST}° off`);
    }

    advance(time, step) { this.plant.doStep(time, step); }

    frame(wall) {
      const elapsed = this.tick(wall);
      if (this.running) {
        const stop = performance.now() + BUDGET, behind = Math.min(1, (this.behind ?? 0) + (elapsed * this.settings.values.speed) / PERIOD % 1);
        let steps = Math.floor((elapsed * this.settings.values.speed) / PERIOD + behind);
        this.behind = behind % 1;
        try {
          for (; steps > 0 && performance.now() < stop && this.time < END - PERIOD / 2; steps--) this.step();
          if (this.time >= END - PERIOD / 2) this.stop(`At the end the largest error after the slew is ${print(this.worst, 0)} millidegrees.`);
        } catch (error) {
          this.stop(`It stopped: ${error.message}.`);
        }
        this.present();
      }
      requestAnimationFrame((time) => this.frame(time));
    }

    stop(text) {
      this.running = false;
      this.over = true;
      this.news.textContent = text;
      this.mark();
    }

    present() {
      const now = [...this.plant.reals(READ)];
      this.scene.show({
        q: now.slice(0, 4),
        tanks: [{ p: [now.slice(10, 13)] }, { p: [now.slice(13, 16)] }],
        arrows: { torque: this.torque, slosh_torque: now.slice(7, 10), thrust: [0, 0, this.settings.values.thrust] },
      });
      this.error.now = Math.min(END, this.time);
      if (!this.running && this.time === 0) {
        this.says.textContent = "At rest. Press Run: nothing moves by itself where the system asks for reduced motion.";
        return;
      }
      if (this.frames % 10 && this.running) return;
      const error = 1000 * (this.off ? this.off[this.axis] : 0), settled = this.time - this.settled > 5 && this.time > this.settings.values.duration;
      this.says.textContent = `${print(this.time, 0)} s. Pointing error ${print(error, 0)} m°, largest after the slew ${print(this.worst, 0)} m°; `
        + `${settled ? `below 10 m° since ${print(this.settled, 0)} s` : "not yet below 10 m°"}. Waves ${now.slice(16).map((x) => print(1000 * x, 1)).join(" and ")} mm.`
        + (this.over ? ` ${this.news.textContent}` : "");
    }
  }

  globalThis.slewReady = Live.mount("slew.png", async (element) => {
    const fmu = await Live.fmu("Spacecraft");
    globalThis.slew = new Slew(fmu, element);
  });
})();
