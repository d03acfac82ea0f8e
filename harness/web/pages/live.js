// What live pages share: controls whose settings stand in the address, plots that grow, and the loop that runs a plant.
globalThis.Live = (() => {
  "use strict";

  const make = (tag, attributes = {}, ...children) => {
    const element = document.createElement(tag);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.append(...children);
    return element;
  };
  const draw = (tag, attributes = {}, text = "") => {
    const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    if (text) element.textContent = text;
    return element;
  };
  const print = (value, digits) => value.toFixed(digits).replace("-", "−");

  // An FMU that the page holds as base64: a script, because a page from the disk may load no data.
  async function fmu(name) {
    const text = atob(globalThis.FMUS[name]);
    return FmuHost.Fmu.open(Uint8Array.from(text, (letter) => letter.charCodeAt(0)));
  }

  /**
   * Controls and their values. Each of `all`: key, label, and either min, max, step, unit, digits and start of a slider or
   * `options` (pairs of value and text) and start of a list;
   * one that is `hidden` has its control elsewhere. `allowed(text)` in place of both is of a text without a control. `changed(key)` is called after the reader has changed one.
   * The address keeps what differs from the start: `#torque=120&fill=90`.
   */
  class Settings {
    constructor(all, changed) {
      this.all = all;
      this.values = Object.fromEntries(all.map(({ key, start }) => [key, start]));
      this.element = make("div", { class: "live-set" });
      this.controls = new Map();
      for (const one of all) {
        if (one.allowed) continue;
        const name = make("span", {}, one.label);
        const control = one.options
          ? make("select", { name: one.key }, ...one.options.map(([value, text]) => make("option", { value }, text)))
          : make("input", { type: "range", name: one.key, min: one.min, max: one.max, step: one.step });
        const shown = one.options ? null : make("output");
        if (!one.hidden) this.element.append(make("label", {}, name, control, ...(shown ? [shown] : [])));
        this.controls.set(one.key, { one, control, shown });
        control.addEventListener("input", () => {
          this.values[one.key] = one.options ? control.value : Number(control.value);
          this.show(one.key);
          this.keep();
          changed(one.key);
        });
      }
      this.read();
      addEventListener("hashchange", () => {
        const before = JSON.stringify(this.values);
        this.read();
        if (JSON.stringify(this.values) !== before) changed(null);
      });
    }

    // Sets one from the program, without calling `changed`.
    set(key, value) {
      this.values[key] = value;
      this.show(key);
    }

    // Shows the controls of these settings alone.
    only(keys) {
      for (const [key, { control }] of this.controls) {
        const label = control.closest("label");
        if (label) label.hidden = !keys.includes(key);
      }
    }

    show(key) {
      if (!this.controls.has(key)) return;
      const { one, control, shown } = this.controls.get(key), value = this.values[key];
      control.value = String(value);
      if (!shown) return;
      shown.textContent = `${print(value / (one.scale ?? 1), one.digits)} ${one.unit}`;
      control.setAttribute("aria-valuetext", shown.textContent);
    }

    // Takes what the address says; what it does not say is as at the start, what is not allowed too.
    read() {
      const said = new URLSearchParams(location.hash.includes("=") ? location.hash.slice(1) : "");
      for (const one of this.all) {
        const text = said.get(one.key), number = Number(text);
        let value = one.start;
        if (text !== null && one.allowed) value = one.allowed(text) ? text : one.start;
        else if (text !== null && one.options) value = one.options.some(([name]) => name === text) ? text : one.start;
        else if (text !== null && Number.isFinite(number)) value = Math.min(one.max, Math.max(one.min, number));
        this.values[one.key] = value;
        this.show(one.key);
      }
    }

    keep() {
      const said = this.all.filter(({ key, start }) => this.values[key] !== start);
      const text = said.map(({ key }) => `${key}=${this.values[key]}`).join("&");
      try {
        history.replaceState(null, "", text ? `#${text}` : location.pathname);
      } catch {
        // a browser that does not let pages from the disk do this: the link stays as it was
      }
    }
  }

  // What counts its frames: .ci/browser reads how many there were and when the first stood.
  class Page {
    frames = 0;
    first = null; // ms since the page was asked for
    #wall = null;

    // Begins a frame at the browser's time `wall`, ms; returns the time since the last in s, at most 0.1 s: a page that was hidden does not catch up.
    tick(wall) {
      const elapsed = Math.min(0.1, (wall - (this.#wall ?? wall)) / 1000);
      this.#wall = wall;
      this.frames += 1;
      this.first ??= performance.now();
      return elapsed;
    }
  }

  /**
   * A plot over one abscissa; `lines` are added and grow. The ordinate begins at 0 or, `signed`, has 0 in the middle, and its
   * range grows with them from `most`; with `range` it stays. `x`: range, label, and the step of its grid or, `log`, decades.
   * A phone has a narrower drawing, whose letters are as large there as the others are on a wide page.
   */
  class Plot {
    #x; #lines = []; #least; #low; #high; #fixed; #axis = draw("g"); #curves = draw("g"); #now = draw("line", { class: "now" }); #dots = []; #width; #at_now = null;
    static WIDE = 560; static NARROW = 360; static HEIGHT = 210; static LEFT = 62; static BOTTOM = 36; static TOP = 10; static RIGHT = 16;

    constructor({ label, x, y, most, signed = false, range = null, caption }) {
      this.#x = x;
      this.#least = signed ? [-most, most] : [0, most];
      this.#fixed = range;
      this.y = y;
      this.svg = draw("svg", { role: "img", "aria-label": label });
      this.svg.append(this.#axis, this.#curves, this.#now);
      this.figure = make("figure", {}, this.svg, make("figcaption", {}, caption));
      const phone = matchMedia("(max-width: 30rem)"), fit = () => {
        this.#width = phone.matches ? Plot.NARROW : Plot.WIDE;
        this.svg.setAttribute("viewBox", `0 0 ${this.#width} ${Plot.HEIGHT}`);
        this.#redraw();
        if (this.#at_now !== null) this.now = this.#at_now;
      };
      phone.addEventListener("change", fit);
      fit();
    }

    line(kind) {
      const line = { points: [], curve: draw("polyline", { class: kind }) };
      this.#curves.append(line.curve);
      this.#lines.push(line);
      return {
        add: (x, y) => {
          line.points.push([x, y]);
          if (!this.#fixed && (y > this.#high || y < this.#low)) this.#redraw();
          else line.curve.setAttribute("points", this.#path(line.points));
        },
        fade: () => line.curve.classList.add("old"),
        drop: () => {
          line.curve.remove();
          this.#lines = this.#lines.filter((other) => other !== line);
        },
        points: line.points,
      };
    }

    // A curve as a whole, and dots with a class each, [x, y, class], in the place of what was there.
    draw(kind, points, dots = []) {
      this.#lines = [{ points, curve: draw("polyline", { class: kind }) }];
      this.#dots = dots.map(([x, y, kind]) => [draw("circle", { class: kind, r: 4.5 }), x, y]);
      this.#curves.replaceChildren(this.#lines[0].curve, ...this.#dots.map(([circle]) => circle));
      this.#redraw();
    }

    clear() {
      [this.#lines, this.#dots] = [[], []];
      this.#curves.replaceChildren();
      this.#redraw();
    }

    set now(x) {
      this.#at_now = x;
      const at = this.#at(x, 0)[0];
      for (const [key, value] of Object.entries({ x1: at, x2: at, y1: Plot.TOP, y2: Plot.HEIGHT - Plot.BOTTOM })) this.#now.setAttribute(key, value);
    }

    #at(x, y) {
      const [low, high] = this.#x.range, part = this.#x.log ? Math.log(x / low) / Math.log(high / low) : (x - low) / (high - low);
      const up = (Math.min(this.#high, Math.max(this.#low, y)) - this.#low) / (this.#high - this.#low);
      return [
        Plot.LEFT + part * (this.#width - Plot.LEFT - Plot.RIGHT),
        Plot.HEIGHT - Plot.BOTTOM - up * (Plot.HEIGHT - Plot.BOTTOM - Plot.TOP),
      ];
    }

    #path(points) {
      return points.map(([x, y]) => this.#at(x, y).map((value) => value.toFixed(1)).join(",")).join(" ");
    }

    #redraw() {
      let [low, high] = this.#fixed ?? this.#least;
      if (!this.#fixed) for (const { points } of this.#lines) for (const [, y] of points) { low = Math.min(low, y); high = Math.max(high, y); }
      if (!this.#fixed && low < 0) [low, high] = [-Math.max(-low, high), Math.max(-low, high)];
      const step = nice((high - low) / 4);
      this.#high = this.#fixed ? high : step * Math.ceil(high / step - 1e-9);
      this.#low = this.#fixed ? low : -step * Math.ceil(-low / step - 1e-9);
      this.#axis.replaceChildren();
      const put = (tag, attributes, text) => this.#axis.append(draw(tag, attributes, text));
      for (let n = Math.ceil(this.#low / step - 1e-9); n * step <= this.#high + 1e-9 * step; n++) {
        const y = n * step, [, at] = this.#at(this.#x.range[0], y);
        put("line", { class: n || !this.#low ? "grid" : "grid zero", x1: Plot.LEFT, x2: this.#width - Plot.RIGHT, y1: at, y2: at });
        put("text", { x: Plot.LEFT - 6, y: at + 4, "text-anchor": "end" }, String(Number(y.toPrecision(6))).replace("-", "−"));
      }
      for (const x of this.#ticks()) {
        const [at] = this.#at(x, 0);
        put("line", { class: "grid", x1: at, x2: at, y1: Plot.TOP, y2: Plot.HEIGHT - Plot.BOTTOM });
        put("text", { x: at, y: Plot.HEIGHT - Plot.BOTTOM + 15, "text-anchor": "middle" }, this.#x.log ? String(Number(x.toPrecision(3))) : x.toFixed(this.#x.digits ?? 1));
      }
      put("text", { x: (Plot.LEFT + this.#width) / 2, y: Plot.HEIGHT - 5, "text-anchor": "middle" }, this.#x.label);
      put("text", { x: 12, y: Plot.HEIGHT / 2 - 10, "text-anchor": "middle", transform: `rotate(-90 12 ${Plot.HEIGHT / 2 - 10})` }, this.y);
      this.#lines.forEach((line) => line.curve.setAttribute("points", this.#path(line.points)));
      for (const [circle, x, y] of this.#dots) this.#at(x, y).forEach((at, i) => circle.setAttribute(["cx", "cy"][i], at));
    }

    #ticks() {
      const [low, high] = this.#x.range, ticks = [];
      if (this.#x.log) for (let power = 10 ** Math.floor(Math.log10(low) + 1e-9); power < high * 1.001; power *= 10) {
        for (const factor of [1, 2, 5]) if (factor * power > low * 0.999 && factor * power < high * 1.001) ticks.push(factor * power);
      } else for (let x = low; x <= high + 1e-9; x += this.#x.step) ticks.push(x);
      return ticks;
    }
  }

  // 1, 2 or 5 times a power of ten, not less than the number.
  function nice(number) {
    const power = 10 ** Math.floor(Math.log10(number));
    return power * [1, 2, 5, 10].find((factor) => factor * power >= number * (1 - 1e-9));
  }

  // A button that does something.
  function button(text, act) {
    const one = make("button", { type: "button" }, text);
    one.addEventListener("click", act);
    return one;
  }

  /** Puts a live page in the place of its picture; what goes wrong is said there, and the picture stays. */
  async function mount(picture, build) {
    const image = document.querySelector(`main img[src="${picture}"]`);
    if (!image) return;
    const place = image.closest("p") ?? image, element = make("div", { class: "live", role: "region", "aria-label": "Live" });
    place.before(element);
    try {
      await build(element);
      place.hidden = true;
    } catch (error) {
      element.replaceChildren(make("p", { class: "live-fault" }, `The page is not live here: ${error.message}`));
    }
  }

  return { make, draw, print, button, fmu, Settings, Page, Plot, mount, still: () => matchMedia("(prefers-reduced-motion: reduce)").matches };
})();
