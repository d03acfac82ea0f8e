// The live page "Your tank": a shape or a drawn contour, and the slosh modes of the liquid in it, by the tank solver.
(() => {
  "use strict";
  const { make, draw, print, button, Settings } = Live;
  const MODES = 3;
  const GRID = 0.01; // points of a drawing stand on it, m
  const LARGEST = 3; // of a drawing, m
  const LATER = 150; // ms after which the picture follows

  const length = (key, label, min, max, start) => ({ key, label, min, max, step: GRID, start, unit: "m", digits: 2 });
  // Of each shape its name in a tank's file and its dimensions, by the settings that they are.
  const SHAPES = {
    cylinder: ["upright cylinder", { radius: "radius", height: "height" }],
    sphere: ["sphere", { radius: "radius" }],
    spheroid: ["spheroid", { radius: "radius", half_height: "half" }],
    cone: ["cone, apex down", { half_angle: "angle", height: "height" }],
    domed_cylinder: ["cylinder with elliptical domes", { radius: "radius", height: "height", bottom: "bottom", top: "top" }],
    torispherical: ["cylinder with torispherical heads", { radius: "radius", height: "height", crown_radius: "crown", knuckle_radius: "knuckle" }],
    annulus: ["annulus", { inner_radius: "inner", outer_radius: "radius", height: "height" }],
    torus: ["torus", { ring_radius: "ring", tube_radius: "tube" }],
    drawn: ["your drawing", {}],
  };
  const points = (text) => text.split("_").map((pair) => pair.split(",").map(Number));
  const allowed = (text) => {
    const all = points(text);
    return all.length > 1 && all.length < 60 && all.every((p) => p.length === 2 && p.every(Number.isFinite) && p[0] >= 0 && p[0] <= LARGEST && Math.abs(p[1]) <= LARGEST);
  };
  const SETTINGS = [
    { key: "shape", label: "Shape", start: "domed_cylinder", options: Object.entries(SHAPES).map(([key, [name]]) => [key, name]) },
    length("radius", "Radius", 0.05, 2, 0.35), length("height", "Height", 0.05, 4, 0.4), length("half", "Half height", 0.05, 2, 0.25),
    { key: "angle", label: "Half angle", min: 5, max: 80, step: 1, start: 30, unit: "°", digits: 0 },
    length("bottom", "Bottom dome", -0.5, 1, 0.2), length("top", "Top dome", 0, 1, 0.2),
    length("crown", "Crown radius", 0.05, 4, 0.6), length("knuckle", "Knuckle radius", 0.01, 1, 0.07),
    length("inner", "Inner radius", 0.01, 1.9, 0.15), length("ring", "Ring radius", 0.06, 2, 0.4), length("tube", "Tube radius", 0.05, 1, 0.15),
    { key: "fill", label: "Fill", min: 2, max: 98, step: 1, start: 50, unit: "%", digits: 0 },
    { key: "g", label: "Acceleration", min: 0.01, max: 20, step: 0.01, start: 9.81, unit: "m/s²", digits: 2 },
    { key: "density", label: "Density", min: 400, max: 2000, step: 2, start: 1000, unit: "kg/m³", digits: 0 },
    { key: "mode", label: "Picture of", start: "1", options: Array.from({ length: MODES }, (_, n) => [String(n + 1), `mode ${n + 1}`]) },
    { key: "contour", start: "0,0_0.2,0.05_0.35,0.25_0.35,0.6_0.15,0.85_0,0.9", allowed },
  ];

  /** The tank solver: a tank's file and the liquid's part of its volume to what the module answers. */
  class Solver {
    static async open() {
      const text = atob(globalThis.MODULES.tank);
      const files = await FmuHost.unzip(Uint8Array.from(text, (letter) => letter.charCodeAt(0)), () => true);
      const { instance } = await WebAssembly.instantiate(files.get("tank.wasm"), {});
      const solver = new Solver();
      solver.module = instance.exports;
      return solver;
    }

    solve(file, share, modes) {
      for (const byte of new TextEncoder().encode(file)) this.module.put(byte);
      const answer = new Uint8Array(this.module.solve(share, modes));
      for (let n = 0; n < answer.length; n++) answer[n] = this.module.get(n);
      return JSON.parse(new TextDecoder().decode(answer));
    }
  }

  class YourTank extends Live.Page {
    constructor(solver, element) {
      super();
      this.time = 0;
      this.solver = solver;
      this.settings = new Settings(SETTINGS, () => this.changed());
      this.running = !Live.still();
      this.build(element);
      this.changed();
      this.picture();
      requestAnimationFrame((time) => this.frame(time));
    }

    build(element) {
      this.place = make("div", { class: "live-scene" });
      this.svg = draw("svg", { viewBox: "0 0 400 300", class: "live-section", role: "group", "aria-label": "Section of the tank" });
      this.body = make("tbody");
      this.says = make("p", { class: "live-says", role: "status" });
      this.run = button("Run", () => { this.running = !this.running; this.mark(); });
      this.edit = button("Draw from here", () => this.adopt());
      this.more = button("Add a point", () => this.insert(this.chosen ?? 0));
      this.less = button("Remove it", () => this.remove(this.chosen ?? 1));
      const heads = ["mode", "frequency, Hz", "slosh mass, kg", "of the liquid", "pendulum, mm", "hinge at, mm", "bob at, mm", "wave, mm per °"];
      const table = make("table", { class: "live-table" }, make("caption", {}, "Antisymmetric modes; heights above the tank's origin"),
        make("thead", {}, make("tr", {}, ...heads.map((text) => make("th", { scope: "col" }, text)))), this.body);
      const caption = make("figcaption", {}, "Section, from the axis: liquid, hinges (circles) and bobs (dots). Points of a drawing are dragged, or moved by arrow keys.");
      element.append(
        make("div", { class: "live-top" }, this.place, make("div", { class: "live-plots" }, make("figure", {}, this.svg, caption))),
        make("div", { class: "live-run", role: "group", "aria-label": "Picture and drawing" }, this.run, this.edit, this.more, this.less),
        this.says, make("div", { class: "live-wide", tabindex: 0, role: "region", "aria-label": "Modes" }, table), this.settings.element,
      );
      this.mark();
    }

    mark() { this.run.textContent = this.running ? "Pause" : "Run"; }

    get drawn() { return this.settings.values.shape === "drawn"; }

    get contour() { return points(this.settings.values.contour); }

    // The tank as `hubslosh tank` reads it.
    get file() {
      const { values } = this.settings, [, dimensions] = SHAPES[values.shape];
      const of = Object.entries(dimensions).map(([name, key]) => `${name} = ${values[key]}`).join(", ");
      const lines = this.contour.slice(1).map((p, i) => `{ line = [${[...this.contour[i], ...p].join(", ")}] }`).join(", ");
      return `density = ${values.density}\n${this.drawn ? `profile = [${lines}]` : `shape.${values.shape} = { ${of} }`}\n`;
    }

    changed() {
      const { values } = this.settings, [, dimensions] = SHAPES[values.shape];
      this.settings.only(["shape", ...Object.values(dimensions), "fill", "g", "density", "mode"]);
      this.edit.hidden = this.drawn;
      this.more.hidden = this.less.hidden = !this.drawn;
      const begin = performance.now(), answer = this.solver.solve(this.file, values.fill / 100, MODES);
      this.took = performance.now() - begin;
      this.problems = answer.problems;
      if (answer.problems) {
        this.says.textContent = answer.problems.join(" ");
        this.says.classList.add("live-fault");
        this.body.replaceChildren();
      } else {
        this.answer = answer;
        this.says.classList.remove("live-fault");
        this.tell();
      }
      this.section();
      clearTimeout(this.later);
      if (this.scene) this.later = setTimeout(() => this.picture(), LATER);
    }

    tell() {
      const { modal } = this.answer, { g } = this.settings.values, mm = (x) => (x === null || x === undefined ? "–" : print(1000 * x, 1));
      this.body.replaceChildren(...modal.modes.map((mode) => make("tr", {}, make("th", { scope: "row" }, String(mode.n)),
        ...[print(Math.sqrt(g * mode.lambda) / (2 * Math.PI), 4), Number(mode.m.toPrecision(4)).toString(), `${print(100 * mode.m_ratio, 2)} %`, mm(mode.l), mm(mode.hinge), mm(mode.H),
          print((1000 * mode.wave * Math.PI) / 180, 2)].map((text) => make("td", {}, text)))));
      const error = modal.error < 1e-6 ? "below one in a million" : `${print(100 * modal.error, 4)} %`;
      this.says.textContent = `${Number(modal.m_liq.toPrecision(4))} kg of liquid, its surface ${print(modal.fill, 3)} m above the lowest point, ${print(modal.R_surface, 3)} m in radius. `
        + `Estimated error: ${error}. Solved in ${print(this.took, 0)} ms.`;
    }

    // The section, and the points of a drawing.
    section() {
      const wall = this.problems ? this.contour : this.answer.outline, { modal } = this.answer ?? {};
      const level = modal ? modal.fill + modal.z_lowest : 0, heights = wall.map((p) => p[1]);
      const [bottom, top, wide] = [Math.min(...heights), Math.max(...heights), Math.max(...wall.map((p) => p[0]))];
      const scale = this.dragging ?? Math.min(340 / wide, 250 / (top - bottom || 1));
      const origin = this.dragging ? this.origin : [40, 275 + scale * bottom];
      this.scale = scale;
      this.origin = origin;
      const at = ([r, z]) => [origin[0] + scale * r, origin[1] - scale * z];
      const path = (all) => all.map((p, i) => `${i ? "L" : "M"}${at(p).map((x) => x.toFixed(1)).join(" ")}`).join("");
      const parts = [draw("line", { x1: origin[0], x2: origin[0], y1: 5, y2: 295, "stroke-dasharray": "8 3 2 3" })];
      if (modal && !this.problems) {
        parts.push(draw("path", { class: "wet", d: `${path(below(wall, level))}Z` }), draw("path", { d: path(wall) }));
        const [inner, outer] = [modal.R_inner ?? 0, modal.R_surface].map((r) => at([r, level]));
        parts.push(draw("line", { class: "level", x1: inner[0], y1: inner[1], x2: outer[0], y2: outer[1] }));
        for (const mode of modal.modes) {
          if (mode.H === null || mode.hinge === null) continue;
          const [x, up] = at([0, mode.hinge]), [, down] = at([0, mode.H]), size = 2.5 + 4 * Math.cbrt(Math.max(0, mode.m_ratio));
          parts.push(draw("line", { x1: x, x2: x, y1: up, y2: down }), draw("circle", { cx: x, cy: up, r: size }), draw("circle", { class: "bob", cx: x, cy: down, r: size }));
          parts.push(draw("text", { x: x - 8, y: down + 4, "text-anchor": "end" }, String(mode.n)));
        }
      } else parts.push(draw("path", { d: path(wall) }));
      const focused = this.focused; // which its removal takes away
      this.svg.replaceChildren(...parts, ...(this.drawn ? this.contour.map((p, i) => this.handle(p, i, at(p))) : []));
      if (this.drawn && focused !== undefined) this.svg.querySelectorAll(".point")[focused]?.focus();
    }

    handle(p, i, [cx, cy]) {
      const label = `Point ${i + 1}: r ${print(p[0], 2)} m, z ${print(p[1], 2)} m`;
      const handle = draw("circle", { class: "point", cx, cy, r: 8, tabindex: 0, role: "button", "aria-label": label });
      handle.addEventListener("focus", () => { this.chosen = this.focused = i; });
      handle.addEventListener("blur", () => { if (handle.isConnected) this.focused = undefined; });
      handle.addEventListener("keydown", (event) => {
        const by = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
        if (by) this.move(i, [p[0] + by[0] * GRID, p[1] + by[1] * GRID]);
        else if (event.key === "Insert" || event.key === "+") this.insert(i);
        else if (event.key === "Delete" || event.key === "-") this.remove(i);
        else return;
        event.preventDefault();
      });
      handle.addEventListener("pointerdown", (event) => {
        event.preventDefault();
        this.chosen = this.focused = i;
        this.dragging = this.scale;
        const box = this.svg.getBoundingClientRect(), unit = 400 / box.width;
        const move = (to) => this.move(i, [((to.clientX - box.left) * unit - this.origin[0]) / this.scale, (this.origin[1] - (to.clientY - box.top) * unit) / this.scale]);
        const end = () => {
          removeEventListener("pointermove", move);
          this.dragging = undefined;
          this.section();
        };
        addEventListener("pointermove", move);
        addEventListener("pointerup", end, { once: true });
        addEventListener("pointercancel", end, { once: true });
      });
      return handle;
    }

    keep(contour) {
      this.settings.values.contour = contour.map((p) => p.map((x) => Number(x.toFixed(2))).join(",")).join("_");
      this.settings.keep();
      this.changed();
    }

    move(i, [r, z]) {
      const within = (x, low) => Math.round(Math.min(LARGEST, Math.max(low, x)) / GRID) * GRID;
      this.keep(this.contour.map((p, k) => (k === i ? [within(r, 0), within(z, -LARGEST)] : p)));
    }

    insert(i) {
      const all = this.contour, next = all[i + 1] ? i + 1 : i, last = next - 1;
      if (all.length > 40) return;
      all.splice(next, 0, [0, 1].map((k) => (all[last][k] + all[next][k]) / 2));
      this.chosen = this.focused = next;
      this.keep(all);
    }

    remove(i) {
      if (this.contour.length < 3) return;
      this.keep(this.contour.filter((_, k) => k !== i));
    }

    // The shape's own outline as a drawing, some points of it.
    adopt() {
      const all = this.answer.outline, each = Math.max(1, Math.ceil(all.length / 16));
      const kept = all.filter((_, i) => i % each === 0 || i === all.length - 1);
      this.settings.set("shape", "drawn");
      this.keep(kept.filter((p, i) => !i || Math.hypot(p[0] - kept[i - 1][0], p[1] - kept[i - 1][1]) > GRID));
    }

    picture() {
      if (!this.answer || this.problems) return;
      const { modal, outline, surfaces } = this.answer, level = modal.fill + modal.z_lowest;
      const modes = modal.modes.map((mode, n) => ({ mode, surface: surfaces[n] })).filter(({ mode }) => mode.H !== null && mode.hinge !== null);
      const heights = outline.map((p) => p[1]), [bottom, top] = [Math.min(...heights), Math.max(...heights)], radius = Math.max(...outline.map((p) => p[0]));
      this.scene?.dispose();
      this.modes = modes;
      this.scene = HubSloshScene.create(this.place, {
        reach: Math.max(radius, (top - bottom) / 2), radius: 1.15 * Math.hypot(radius, (top - bottom) / 2), target: [0, 0, (top + bottom) / 2],
        tanks: [{
          shape: { contour: outline.map(([r, z]) => [Math.max(0, r), z]) }, level,
          modes: modes.map(({ mode, surface }) => ({ hinge: mode.hinge, length: mode.l, mass: Math.max(mode.m, 1e-6), wave: mode.wave, shape: along(surface, modal.R_surface, mode.wave) })),
        }],
      }, { label: "The tank in three dimensions. Arrow keys turn the view, plus and minus zoom, 0 shows all." });
      this.show();
    }

    frame(wall) {
      const elapsed = this.tick(wall);
      if (this.running && this.scene) {
        this.time += elapsed;
        this.show();
      }
      requestAnimationFrame((time) => this.frame(time));
    }

    // The chosen mode, an eighth of the surface's radius high; at most one oscillation a second.
    show() {
      const { modal } = this.answer, { mode, g } = this.settings.values;
      const phase = 2 * Math.PI * Math.min(1, Math.sqrt(g * (modal.modes[mode - 1]?.lambda ?? 1)) / (2 * Math.PI)) * this.time;
      const p = this.modes.map(({ mode: one }) => {
        const angle = String(one.n) === mode ? Math.min(0.5, modal.R_surface / 8 / Math.max(one.wave, one.wave_peak ?? 0)) * Math.cos(phase) : 0;
        return [Math.sin(angle), 0, -Math.cos(angle)];
      });
      this.scene.show({ tanks: [{ p }] });
    }
  }

  // The part of a contour that is below a height, where it comes to it with an end there.
  function below(wall, level) {
    const kept = [];
    wall.forEach((p, i) => {
      const q = wall[i - 1];
      if (q && q[1] > level !== p[1] > level) kept.push([q[0] + ((p[0] - q[0]) * (level - q[1])) / (p[1] - q[1]), level]);
      if (p[1] <= level) kept.push(p);
    });
    const [first, last] = [kept[0], kept.at(-1)];
    return first && first[1] < level ? [...kept, [0, last[1]], [0, first[1]]] : kept;
  }

  // A mode's surface at equal steps from axis to wall, 1 at the wall.
  function along(surface, radius, wave) {
    const n = 48;
    return Array.from({ length: n + 1 }, (_, i) => {
      const r = (radius * i) / n, next = surface.findIndex((p) => p[0] >= r);
      if (next <= 0) return (next ? surface.at(-1) : surface[0])[1] / wave;
      const [a, b] = [surface[next - 1], surface[next]];
      return (a[1] + ((b[1] - a[1]) * (r - a[0])) / (b[0] - a[0])) / wave;
    });
  }

  globalThis.yourTankReady = Live.mount("your_tank.png", async (element) => {
    const solver = await Solver.open();
    globalThis.your_tank = new YourTank(solver, element);
  });
})();
