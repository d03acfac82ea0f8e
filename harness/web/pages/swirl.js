// The live page "Swirl": HubSlosh under a sinusoidal torque whose frequency is held or swept.
(() => {
  "use strict";
  const { make, print, button, Settings, Plot } = Live;
  const FREQUENCIES = [2.0, 2.8]; // Hz
  const STEP = 0.01; // communication step, s; between its ends the torque is a straight line
  const WINDOW = 4; // periods over which an amplitude is taken
  const XI = 1.8411837813406593; // first zero of J1'
  const BUDGET = 12; // ms of a frame for the plant
  const DEGREES = 180 / Math.PI;
  const READ = ["slosh_angle", "slosh_angle_radial", "omega", "theta", "tau_actuator", "tau_friction", "tau_fluid", "wave_height"];

  const SETTINGS = [
    { key: "torque", label: "Torque", min: 5, max: 250, step: 5, start: 100, unit: "mN·m", digits: 0 },
    { key: "frequency", label: "Frequency", min: FREQUENCIES[0], max: FREQUENCIES[1], step: 0.005, start: 2.2, unit: "Hz", digits: 3 },
    { key: "fill", label: "Fill height", min: 30, max: 150, step: 5, start: 100, unit: "mm", digits: 0 },
    { key: "damping", label: "Damping ratio", min: 0.001, max: 0.05, step: 0.0005, start: 0.003, unit: "%", digits: 2, scale: 0.01 },
    { key: "rate", label: "Sweep rate", min: 0.02, max: 0.3, step: 0.02, start: 0.06, unit: "Hz/min", digits: 2 },
    { key: "speed", label: "Speed", min: 1, max: 100, step: 1, start: 60, unit: "×", digits: 0 },
    { key: "model", label: "Liquid", start: "spherical", options: [["linear", "linear pendulum"], ["planar", "pendulum in a plane"], ["spherical", "spherical pendulum"], ["paraboloid", "mass on a paraboloid"], ["liquid", "first mode to third order"], ["frozen", "rigid liquid"]] },
    { key: "bearing", label: "Bearing", start: "stribeck", options: [["none", "without friction"], ["viscous", "viscous"], ["stribeck", "dry, sticks"], ["lugre", "dry, bristles (LuGre)"]] },
  ];
  const WAYS = { up: 1, down: -1, hold: 0 };
  SETTINGS.push({ key: "sweep", label: "Sweep", start: "up", hidden: true, options: Object.keys(WAYS).map((way) => [way, way]) });
  // What an instance is made with: a change of these begins anew.
  const FIXED = ["fill", "damping", "model", "bearing"];

  class Swirl extends Live.Page {
    // 1: the frequency rises, -1: it falls, 0: it is held.
    get sweep() { return WAYS[this.settings.values.sweep]; }

    set sweep(way) {
      this.settings.set("sweep", Object.keys(WAYS).find((name) => WAYS[name] === way));
    }

    constructor(fmu, element) {
      super();
      this.fmu = fmu;
      this.settings = new Settings(SETTINGS, (key) => this.changed(key));
      this.running = !Live.still();
      this.phase = 0; // of the torque, rad
      const x = { range: FREQUENCIES, step: 0.1, label: "frequency of the torque, Hz" };
      this.angles = new Plot({ x, y: "slosh angle, °", most: 10, label: "Amplitude of the slosh angle against frequency",
        caption: "Liquid: amplitude along the arm's motion (solid) and across it (dashed), which the torque does not push." });
      this.rates = new Plot({ x, y: "hub rate, °/s", most: 2, label: "Amplitude of the hub's rate against frequency",
        caption: "Hub: amplitude of its rate. Blue: frequency rises; orange: it falls; grey: held." });
      this.build(element);
      this.restart();
      this.present();
      requestAnimationFrame((time) => this.frame(time));
    }

    build(element) {
      this.place = make("div", { class: "live-scene" });
      this.says = make("p", { class: "live-says" });
      this.news = make("p", { class: "live-news", role: "status" }); // for those who do not see the motion
      this.buttons = {
        run: button("Run", () => { this.running = !this.running; this.mark(); }),
        up: button("Sweep up", () => this.begin(1)),
        down: button("Sweep down", () => this.begin(-1)),
        hold: button("Hold", () => this.begin(0)),
      };
      const clear = button("Clear plots", () => { this.angles.clear(); this.rates.clear(); this.trace(); });
      const anew = button("From rest", () => { this.restart(); this.present(); });
      element.append(
        make("div", { class: "live-top" }, this.place, make("div", { class: "live-plots" }, this.angles.figure, this.rates.figure)),
        make("div", { class: "live-run", role: "group", "aria-label": "Run" }, ...Object.values(this.buttons), anew, clear),
        this.says, this.news, this.settings.element,
      );
      this.mark();
    }

    mark() {
      const { run, up, down, hold } = this.buttons;
      run.textContent = this.running ? "Pause" : "Run";
      [[up, 1], [down, -1], [hold, 0]].forEach(([one, way]) => one.setAttribute("aria-pressed", String(this.sweep === way)));
    }

    begin(way) {
      this.sweep = way;
      this.settings.keep();
      this.running = true;
      this.trace();
      this.mark();
    }

    changed(key) {
      if (key === null || FIXED.includes(key)) {
        this.restart();
        this.mark();
      }
      if (key === "frequency" || key === "torque") {
        if (key === "frequency") this.sweep = 0; // the reader leads
        this.settings.keep();
        this.trace();
        this.mark();
      }
      this.present();
    }

    // A new instance at rest, with the settings as they are.
    restart() {
      const { fill, damping, model, bearing } = this.settings.values;
      this.plant?.free();
      this.time = this.phase = 0;
      this.last = null;
      this.plant = this.fmu.instantiate();
      // the smallest disturbance across the arm: without one a pendulum that could swirl has nothing to start from
      this.plant.set({
        "slosh.model": model, "friction.model": bearing, "tank.h": fill / 1000, "slosh.zeta_from_correlation": false, "slosh.zeta": damping,
        "init.slosh_angle": 0, "init.slosh_angle_radial": ["spherical", "paraboloid", "liquid"].includes(model) ? 1e-4 : 0,
      });
      this.plant.initialize();
      const [diameter, arm, length, mass, natural] = this.plant.get(["tank.d", "tank.r", "slosh.length[1]", "slosh.mass[1]", "slosh.frequency[1]"]);
      this.natural = natural;
      this.scene?.dispose();
      const height = Math.max(1.5 * fill / 1000, fill / 1000 + 0.05), liquid = model !== "frozen";
      this.scene = HubSloshScene.create(this.place, {
        reach: arm + 0.62 * diameter, radius: arm + 0.62 * diameter, target: [0.35 * arm, 0, 0.3 * height],
        bench: { wheel: 0.0625, arm: { length: arm, width: 0.06, plate: 0.6 * diameter } },
        tanks: [{
          position: [arm, 0, 0], shape: { contour: HubSloshScene.cylinder(diameter / 2, 0, height) }, level: fill / 1000,
          modes: liquid ? [{ hinge: fill / 1000, length: Math.min(length, fill / 1000), mass, wave: diameter / (XI * XI - 1) }] : [],
        }],
        arrows: [["tau_actuator", "torque"], ["tau_fluid", "liquid's torque"]].map(([name, label], n) => (
          { name, label, unit: "N·m", kind: "torque", most: 0.5, arc: { radius: 0.085 + 0.03 * n, z: 0.01, from: Math.PI / 2, most: 2 } })),
      }, { label: "Hub, tank and liquid in three dimensions. Arrow keys turn the view, plus and minus zoom, 0 shows all." });
      this.trace();
    }

    // New lines in the plots; older ones fade.
    trace() {
      this.lines?.forEach((line) => line.fade());
      const kind = { 1: "up", "-1": "down", 0: "hold" }[this.sweep];
      this.lines = [this.angles.line(kind), this.angles.line(`${kind} radial`), this.rates.line(kind)];
      this.most = [0, 0, 0];
      this.from = this.phase;
      this.fresh = true; // what was before this trace is in its first window
    }

    // One communication step.
    step() {
      const { torque, rate } = this.settings.values, before = this.settings.values.frequency;
      let frequency = before + this.sweep * (rate / 60) * STEP;
      if (frequency <= FREQUENCIES[0] || frequency >= FREQUENCIES[1]) {
        // at the end of the range the sweep turns round
        frequency = Math.min(FREQUENCIES[1], Math.max(FREQUENCIES[0], frequency));
        this.sweep = -this.sweep;
        this.settings.values.frequency = frequency;
        this.trace();
        this.mark();
      }
      const next = this.phase + Math.PI * (before + frequency) * STEP;
      const [from, to] = [this.phase, next].map((phase) => (torque / 1000) * Math.sin(phase));
      this.plant.set({ tau_cmd: from });
      this.plant.setInputDerivatives({ tau_cmd: (to - from) / STEP });
      this.plant.doStep(this.time, STEP);
      this.time += STEP;
      this.phase = next;
      this.settings.values.frequency = frequency;
      const now = this.plant.reals(READ);
      [0, 1, 2].forEach((n) => { this.most[n] = Math.max(this.most[n], Math.abs(now[n]) * DEGREES); });
      if (this.phase - this.from < 2 * Math.PI * WINDOW) return;
      if (!this.fresh) this.lines.forEach((line, n) => line.add(frequency, this.most[n]));
      this.fresh = false;
      this.last = this.most;
      this.most = [0, 0, 0];
      this.from = this.phase;
    }

    frame(wall) {
      const elapsed = this.tick(wall);
      if (this.running) {
        const { speed, frequency } = this.settings.values;
        // Fast, several periods pass from frame to frame: of them the instant is drawn whose phase goes on as in real time.
        this.shown = ((this.shown ?? 0) + 2 * Math.PI * frequency * elapsed) % (2 * Math.PI);
        const steps = Math.round((elapsed * speed) / STEP), stop = performance.now() + BUDGET;
        let best = Infinity, chosen;
        try {
          for (let n = 0; n < steps && performance.now() < stop; n++) {
            this.step();
            const away = Math.abs(Math.sin((this.phase - this.shown) / 2));
            if (away <= best || steps < 0.5 / (frequency * STEP)) {
              best = away;
              chosen = [...this.plant.reals(READ)];
            }
          }
        } catch (error) {
          this.running = false;
          this.says.textContent = `It stopped: ${error.message}`;
          this.stopped = true;
          this.mark();
        }
        if (chosen) this.present(chosen);
      }
      requestAnimationFrame((time) => this.frame(time));
    }

    present(now = [...this.plant.reals(READ)]) {
      const [tangential, radial, , theta, actuator, , fluid, wave] = now, { frequency, model } = this.settings.values;
      const [x, y] = [Math.sin(radial), Math.sin(tangential)];
      const down = -Math.sqrt(Math.max(0, 1 - x * x - y * y));
      this.scene.show({
        q: [Math.cos(theta / 2), 0, 0, Math.sin(theta / 2)],
        tanks: [{ p: model === "frozen" ? [] : [[x, y, down]] }],
        arrows: { tau_actuator: actuator, tau_fluid: fluid },
      });
      this.settings.show("frequency");
      this.angles.now = this.rates.now = frequency;
      if (this.frames % 15 && this.running && this.frames > 1) return;
      const [along, across] = this.last ?? [0, 0];
      const swirls = across > 0.2 * along && across > 2;
      if (swirls !== this.swirls) this.news.textContent = swirls ? `The liquid swirls, at ${print(frequency, 2)} Hz.` : "";
      this.swirls = swirls;
      this.says.textContent = this.running || this.time > 0
        ? `${print(this.time, 0)} s. The tank alone: ${print(this.natural, 3)} Hz. Amplitude along ${print(along, 1)}°, across ${print(across, 1)}°, wave ${print(1000 * wave, 1)} mm: ${swirls ? "the liquid swirls." : "it moves in the plane of the torque."}`
        : "At rest. Press Run: nothing moves by itself where the system asks for reduced motion.";
    }
  }

  globalThis.swirlReady = Live.mount("swirl.png", async (element) => {
    const fmu = await Live.fmu("HubSlosh");
    globalThis.swirl = new Swirl(fmu, element);
  });
})();
