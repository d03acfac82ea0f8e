// Draws a bench or a spacecraft with its tanks, the liquid in them, pendulums, forces and torques.
//
// `HubSloshScene.create(element, geometry, options)` makes a picture that fills `element`, and `show(state)` draws one
// instant. README.md in this folder describes the keys of `geometry` and `state`. All values are in SI units, and z
// points up along the bearing's axis or the thrust. The file needs the bundle of three.js (../three) as the global THREE.
globalThis.HubSloshScene = (() => {
  "use strict";

  // The zeros of J1' and a function for J1. Its power series is exact enough for a picture up to the tenth zero, at 31.
  const XI = [1.8411837813, 5.3314427735, 8.5363163664, 11.7060049026, 14.8635886339, 18.0155278627, 21.1643698592, 24.3113268572, 27.4570505711, 30.601922973];
  function j1(x) {
    let term = x / 2, sum = term;
    for (let k = 1; k < 90; k++) {
      term *= -(x * x) / (4 * k * (k + 1));
      sum += term;
      if (Math.abs(term) < 1e-12) break;
    }
    return sum;
  }

  const COLORS = {
    light: { paper: "#ffffff", ink: "#1b1f24", soft: "#59636e", line: "#c3cad1", glass: "#59636e", liquid: "#2a86d1", surface: "#3f9be6", bob: "#c2410c", body: "#7d8894", hub: "#aeb7c0", metal: "#8d98a3" },
    dark: { paper: "#14181d", ink: "#e6eaee", soft: "#9aa5b1", line: "#3a444f", glass: "#b8c2cc", liquid: "#2f8fe0", surface: "#58adf2", bob: "#ff9d5c", body: "#93a0ad", hub: "#5b6772", metal: "#75828e" },
  };
  // Colours for arrows that have none of their own and for the curves of a page. They follow Okabe and Ito, and each
  // has a contrast of 3:1 with its background.
  const ARROWS = { light: ["#b84a00", "#0072b2", "#00805d", "#a8527f", "#6d4fb3", "#8a6a00"], dark: ["#ff8a4c", "#56b4e9", "#2fd0a3", "#e79ac4", "#b79cf0", "#f0c24b"] };
  const AROUND = 64, RINGS = 16, WALL = 40; // RINGS is the least number of rings; a tank has at least eight for every mode

  // Returns the contour of an upright cylinder as points (r, z), m, from the axis along the bottom and up the wall.
  const cylinder = (radius, bottom, top) => [[0, bottom], [radius, bottom], [radius, top]];
  // Returns the contour of a sphere in the same form.
  const sphere = (radius, z) => Array.from({ length: 49 }, (_, i) => {
    const a = -Math.PI / 2 + (Math.PI * i) / 48;
    return [Math.max(0, radius * Math.cos(a)), z + radius * Math.sin(a)];
  });

  // Adds points on the straight lines of a contour, so that the edge of the liquid can end close to any height.
  function refine(contour) {
    const length = contour.slice(1).reduce((sum, p, i) => sum + Math.hypot(p[0] - contour[i][0], p[1] - contour[i][1]), 0);
    const fine = [contour[0]];
    contour.slice(1).forEach((p, i) => {
      const q = contour[i], n = Math.max(1, Math.ceil((WALL * Math.hypot(p[0] - q[0], p[1] - q[1])) / length));
      for (let k = 1; k <= n; k++) fine.push([q[0] + ((p[0] - q[0]) * k) / n, q[1] + ((p[1] - q[1]) * k) / n]);
    });
    return fine;
  }

  // Returns functions that give a contour's radius at a height z: of the outer wall and, if there is one, of the inner
  // wall. Both are searched upwards from the contour's lowest point.
  function wall(contour) {
    const low = contour.reduce((best, p, i) => (p[1] <= contour[best][1] ? i : best), 0);
    const outer = contour.slice(low), inner = contour.slice(0, low + 1).reverse();
    const top = Math.max(...outer.map((p) => p[1]));
    const radius = (part, z, beyond) => {
      for (let i = 1; i < part.length; i++) {
        const [a, b] = [part[i - 1], part[i]];
        if (b[1] >= z && b[1] > a[1]) return a[0] + ((b[0] - a[0]) * (z - a[1])) / (b[1] - a[1]);
      }
      return beyond;
    };
    return {
      low, bottom: contour[low][1], top,
      outer: (z) => radius(outer, Math.min(z, top), outer[outer.length - 1][0]),
      inner: (z) => (inner.length > 1 ? radius(inner, z, 0) : 0),
    };
  }

  // Returns the shape of the nth mode's surface along the radius. The coordinate s goes from s0 (the axis or the inner
  // wall) to 1 at the outer wall, where the shape is 1.
  function alongRadius(mode, shape, n, s0) {
    if (shape) {
      const last = shape.length - 1;
      return (s) => {
        const at = ((s - s0) / (1 - s0)) * last, i = Math.max(0, Math.min(Math.floor(at), last - 1));
        return shape[i] + (shape[i + 1] - shape[i]) * (at - i);
      };
    }
    const xi = XI[Math.min(n, XI.length - 1)], whole = j1(xi);
    return (s) => j1(xi * s) / whole;
  }

  const angle = (component) => Math.asin(Math.max(-1, Math.min(1, component)));

  // A tank with its glass, its liquid and its pendulums. `draw(state, exaggeration)` moves the liquid and the pendulums.
  class Tank {
    constructor(data, size) {
      this.data = data;
      this.group = new THREE.Group();
      if (data.position) this.group.position.fromArray(data.position);
      if (data.q) this.group.quaternion.set(data.q[1], data.q[2], data.q[3], data.q[0]).normalize();
      this.glass = new THREE.MeshLambertMaterial({ transparent: true, opacity: 0.1, side: THREE.DoubleSide, depthWrite: false });
      this.edge = new THREE.LineBasicMaterial({ transparent: true, opacity: 0.75 });
      this.wet = new THREE.MeshLambertMaterial({ transparent: true, opacity: 0.3, side: THREE.DoubleSide, depthWrite: false });
      this.top = new THREE.MeshPhongMaterial({ transparent: true, opacity: 0.55, side: THREE.DoubleSide, depthWrite: false, shininess: 60, specular: 0x333333 });
      this.metal = new THREE.MeshLambertMaterial();
      this.rod = new THREE.MeshLambertMaterial();
      this.materials = [this.glass, this.edge, this.wet, this.top, this.metal, this.rod];
      this.rings = Math.max(RINGS, 8 * data.modes.length);
      if (data.shape.box) this.makeBox(data.shape); else this.makeRevolved(data.shape.contour);
      const reach = this.extent;
      const masses = data.modes.map((m) => m.mass || 1), most = Math.max(...masses);
      this.pendulums = data.modes.map((mode, n) => {
        const radius = 0.1 * reach * Math.cbrt(masses[n] / most);
        const bob = new THREE.Mesh(new THREE.SphereGeometry(radius, 24, 16), this.metal);
        const rod = new THREE.Mesh(new THREE.CylinderGeometry(1, 1, 1, 8), this.rod);
        const hinge = new THREE.Mesh(new THREE.SphereGeometry(0.3 * radius, 12, 8), this.rod);
        this.group.add(bob, rod, hinge);
        return { bob, rod, hinge, thick: 0.1 * radius };
      });
    }

    makeRevolved(contour) {
      this.wall = wall(contour);
      this.contour = refine(contour);
      this.low = wall(this.contour).low;
      this.extent = Math.max(...contour.map((p) => p[0]));
      const lathe = new THREE.Mesh(new THREE.LatheGeometry(contour.map((p) => new THREE.Vector2(p[0], p[1])), AROUND), this.glass);
      lathe.rotation.x = Math.PI / 2; // the lathe turns around y, the tank around z
      this.group.add(lathe);
      // Circles show where the contour has a corner or ends.
      const corners = contour.filter((p, i) => p[0] > 0 && (i === 0 || i === contour.length - 1 || turn(contour[i - 1], p, contour[i + 1]) > 0.35));
      const widest = contour.reduce((a, b) => (b[0] > a[0] ? b : a));
      for (const [r, z] of [...corners, widest]) this.group.add(circle(r, z, this.edge));
      this.surface = grid(AROUND + 1, this.rings + 1, this.top);
      this.body = grid(AROUND + 1, this.contour.length, this.wet);
      this.rim = circle(1, 0, this.edge);
      this.group.add(this.body, this.surface, this.rim);
    }

    makeBox({ box: [a, b], bottom, top }) {
      this.wall = { bottom, top };
      this.extent = 0.5 * Math.max(a, b);
      const mesh = new THREE.Mesh(new THREE.BoxGeometry(a, b, top - bottom), this.glass);
      mesh.position.z = (bottom + top) / 2;
      const edges = new THREE.LineSegments(new THREE.EdgesGeometry(mesh.geometry), this.edge);
      edges.position.copy(mesh.position);
      this.surface = grid(this.rings + 1, this.rings + 1, this.top);
      this.body = grid(4 * this.rings + 1, 2, this.wet);
      this.group.add(mesh, edges, this.body, this.surface);
    }

    draw(state, exaggeration) {
      const level = state.level ?? this.data.level, p = state.p;
      this.angles = p.map((one) => [angle(one[0]), angle(one[1])]);
      this.height = (value) => Math.max(this.wall.bottom, Math.min(this.wall.top, level + exaggeration * value));
      if (this.data.shape.box) this.drawBox(); else this.drawRevolved(level, state.modes);
      this.surface.geometry.computeVertexNormals();
      this.body.geometry.computeVertexNormals();
      this.pendulums.forEach(({ bob, rod, hinge, thick }, n) => {
        const mode = state.modes?.[n] ?? this.data.modes[n];
        const direction = new THREE.Vector3().fromArray(p[n]);
        hinge.position.set(0, 0, mode.hinge);
        bob.position.copy(hinge.position).addScaledVector(direction, mode.length);
        rod.position.copy(hinge.position).addScaledVector(direction, mode.length / 2);
        rod.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), direction.clone().normalize());
        rod.scale.set(thick, mode.length, thick);
      });
    }

    drawRevolved(level, modes) {
      const surface = this.surface.geometry.attributes.position, body = this.body.geometry.attributes.position;
      const rim = this.rim.geometry.attributes.position, rings = this.rings;
      const hollow = this.wall.inner(level) > 0, s0 = hollow ? this.wall.inner(level) / this.wall.outer(level) : 0;
      // The elevation of every mode per slosh angle on each ring, m/rad.
      const eta = this.data.modes.map((mode, n) => {
        const along = alongRadius(mode, modes?.[n].shape ?? mode.shape, n, s0);
        return Array.from({ length: rings + 1 }, (_, k) => mode.wave * along(s0 + ((1 - s0) * k) / rings));
      });
      for (let i = 0; i <= AROUND; i++) {
        const azimuth = (2 * Math.PI * i) / AROUND, cos = Math.cos(azimuth), sin = Math.sin(azimuth);
        const tilt = this.angles.map(([x, y]) => x * cos + y * sin);
        const height = (k) => this.height(eta.reduce((sum, one, n) => sum + one[k] * tilt[n], 0));
        const edge = height(rings), r1 = this.wall.outer(edge);
        const innerEdge = hollow ? height(0) : Infinity, r0 = hollow ? this.wall.inner(innerEdge) : 0;
        for (let k = 0; k <= rings; k++) {
          const r = r0 + ((r1 - r0) * k) / rings;
          surface.setXYZ(i * (rings + 1) + k, r * cos, r * sin, height(k));
        }
        this.contour.forEach(([r, z], k) => {
          const [end, at] = k < this.low ? [innerEdge, r0] : [edge, r1];
          const over = z > end;
          body.setXYZ(i * this.contour.length + k, (over ? at : r) * cos, (over ? at : r) * sin, over ? end : z);
        });
        if (i < AROUND) rim.setXYZ(i, r1 * cos, r1 * sin, edge);
      }
      surface.needsUpdate = body.needsUpdate = rim.needsUpdate = true;
    }

    drawBox() {
      const [a, b] = this.data.shape.box, surface = this.surface.geometry.attributes.position, body = this.body.geometry.attributes.position, rings = this.rings;
      // The modes of a box along each side are sin((2n - 1) pi x/a), with sign so that they are 1 at the wall. Each
      // side counts its own modes.
      const eta = (x, y) => this.angles.reduce((sum, [ax, ay], n) => {
        const order = this.data.modes[n].order ?? n, odd = 2 * order + 1, sign = order % 2 ? -1 : 1;
        return sum + sign * this.data.modes[n].wave * (ax * Math.sin((odd * Math.PI * x) / a) + ay * Math.sin((odd * Math.PI * y) / b));
      }, 0);
      for (let i = 0; i <= rings; i++) for (let k = 0; k <= rings; k++) {
        const x = a * (i / rings - 0.5), y = b * (k / rings - 0.5);
        surface.setXYZ(i * (rings + 1) + k, x, y, this.height(eta(x, y)));
      }
      for (let i = 0; i <= 4 * rings; i++) {
        const side = Math.floor(i / rings) % 4, along = (i % rings) / rings - 0.5;
        const [x, y] = [[a * along, -b / 2], [a / 2, b * along], [-a * along, b / 2], [-a / 2, -b * along]][side];
        body.setXYZ(2 * i, x, y, this.wall.bottom);
        body.setXYZ(2 * i + 1, x, y, this.height(eta(x, y)));
      }
      surface.needsUpdate = body.needsUpdate = true;
    }

    recolor(colors) {
      this.glass.color.set(colors.glass);
      this.edge.color.set(colors.glass);
      this.wet.color.set(colors.liquid);
      this.top.color.set(colors.surface);
      this.metal.color.set(colors.bob);
      this.metal.emissive.set(colors.bob).multiplyScalar(0.45); // so that the bobs are visible through the liquid
      this.rod.color.set(colors.ink);
    }
  }

  function turn(a, b, c) {
    if (!c) return Math.PI;
    const one = Math.atan2(b[1] - a[1], b[0] - a[0]), two = Math.atan2(c[1] - b[1], c[0] - b[0]);
    return Math.abs(Math.atan2(Math.sin(two - one), Math.cos(two - one)));
  }

  function circle(radius, z, material) {
    const points = Array.from({ length: AROUND }, (_, i) => {
      const a = (2 * Math.PI * i) / AROUND;
      return new THREE.Vector3(radius * Math.cos(a), radius * Math.sin(a), z);
    });
    return new THREE.LineLoop(new THREE.BufferGeometry().setFromPoints(points), material);
  }

  // Makes a mesh of `columns` by `rows` vertices whose positions are set later.
  function grid(columns, rows, material) {
    const geometry = new THREE.BufferGeometry(), index = [];
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3 * columns * rows), 3));
    for (let i = 0; i + 1 < columns; i++) for (let k = 0; k + 1 < rows; k++) {
      const at = i * rows + k;
      index.push(at, at + rows, at + 1, at + 1, at + rows, at + rows + 1);
    }
    geometry.setIndex(index);
    const mesh = new THREE.Mesh(geometry, material);
    mesh.frustumCulled = false;
    return mesh;
  }

  // A straight arrow along a vector. A torque's arrow lies along its axis by the right-hand rule and has two heads.
  class Arrow {
    constructor(data, size) {
      this.group = new THREE.Group();
      this.material = new THREE.MeshLambertMaterial();
      this.thick = 0.012 * size;
      this.shaft = new THREE.Mesh(new THREE.CylinderGeometry(1, 1, 1, 12), this.material);
      this.heads = Array.from({ length: data.kind === "torque" ? 2 : 1 }, () => new THREE.Mesh(new THREE.ConeGeometry(1, 1, 16), this.material));
      this.group.add(this.shaft, ...this.heads);
      this.base = new THREE.Vector3().fromArray(data.at || [0, 0, 0]);
      this.tip = Boolean(data.tip);
    }

    draw(vector, length) {
      this.group.visible = length > 0.2 * this.thick;
      if (!this.group.visible) return;
      const along = new THREE.Vector3().fromArray(vector).normalize();
      this.group.position.copy(this.base).addScaledVector(along, this.tip ? -length : 0);
      this.group.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), along);
      const head = Math.min(6 * this.thick, (0.8 * length) / this.heads.length), wide = Math.min(2.4 * this.thick, 0.5 * head);
      const stem = length - head * this.heads.length;
      this.shaft.scale.set(0.35 * wide, Math.max(stem, 1e-6), 0.35 * wide);
      this.shaft.position.y = stem / 2;
      this.heads.forEach((cone, i) => {
        cone.scale.set(wide, head, wide);
        cone.position.y = stem + head * (i + 0.5);
      });
    }
  }

  // An arc around the z axis that shows a torque about it. It begins at the direction `from`, rad.
  class Arc {
    constructor(data, size) {
      this.data = data;
      this.group = new THREE.Group();
      this.material = new THREE.MeshLambertMaterial({ side: THREE.DoubleSide });
      this.thick = 0.009 * size;
      this.tube = grid(49, 9, this.material);
      this.head = new THREE.Mesh(new THREE.ConeGeometry(2.6 * this.thick, 7 * this.thick, 16), this.material);
      this.group.position.set(0, 0, data.arc.z || 0);
      this.group.add(this.tube, this.head);
    }

    // `turn` is the angle that the arc covers, rad, with its sign.
    draw(turn) {
      const { radius, from } = this.data.arc, thick = this.thick;
      this.group.visible = Math.abs(turn) > 0.01;
      if (!this.group.visible) return;
      const position = this.tube.geometry.attributes.position;
      for (let i = 0; i <= 48; i++) {
        const a = from + (turn * i) / 48, cos = Math.cos(a), sin = Math.sin(a);
        for (let k = 0; k <= 8; k++) {
          const b = (Math.PI * k) / 4, r = radius + thick * Math.cos(b);
          position.setXYZ(i * 9 + k, r * cos, r * sin, thick * Math.sin(b));
        }
      }
      position.needsUpdate = true;
      this.tube.geometry.computeVertexNormals();
      const a = from + turn, sign = Math.sign(turn);
      this.head.scale.setScalar(Math.min(1, (Math.abs(turn) * radius) / (7 * thick)));
      this.head.position.set(radius * Math.cos(a), radius * Math.sin(a), 0);
      this.head.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), new THREE.Vector3(-sign * Math.sin(a), sign * Math.cos(a), 0));
    }
  }

  // Draws the bench: a fixed base with marks every 30 degrees, the platform that turns with the tank, and the
  // wheel on the axis.
  function bench({ reach, wheel, arm, below }, root, fixed, paint) {
    const hub = paint(new THREE.MeshLambertMaterial(), "hub"), metal = paint(new THREE.MeshLambertMaterial(), "metal");
    const line = paint(new THREE.LineBasicMaterial(), "soft");
    const upright = (mesh, z) => { mesh.rotation.x = Math.PI / 2; mesh.position.z = z; return mesh; };
    const thick = 0.05 * reach, plate = 0.42 * reach;
    // The platform is an arm from the axis to the tank with a round plate under both ends.
    root.add(upright(new THREE.Mesh(new THREE.CylinderGeometry(plate, plate, thick, 64), hub), -thick / 2 - 1e-3 * reach));
    const beam = new THREE.Mesh(new THREE.BoxGeometry(arm.length, arm.width, thick), hub);
    beam.position.set(arm.length / 2, 0, -thick / 2 - 1e-3 * reach);
    root.add(beam, upright(new THREE.Mesh(new THREE.CylinderGeometry(arm.plate, arm.plate, thick, 64), hub), -thick / 2 - 1e-3 * reach));
    root.children.at(-1).position.x = arm.length;
    const rotor = new THREE.Group(), spoke = new THREE.Mesh(new THREE.BoxGeometry(1.9 * wheel, 0.12 * wheel, 0.36 * wheel), paint(new THREE.MeshLambertMaterial(), "ink"));
    rotor.add(upright(new THREE.Mesh(new THREE.CylinderGeometry(wheel, wheel, 0.3 * wheel, 48), metal), 0.3 * wheel), spoke);
    spoke.position.z = 0.3 * wheel;
    if (below) rotor.position.z = -thick - 0.6 * wheel;
    root.add(rotor);
    fixed.add(upright(new THREE.Mesh(new THREE.CylinderGeometry(0.12 * reach, 0.2 * reach, 0.45 * reach, 48), metal), -thick - 0.225 * reach));
    const z = -thick - 0.45 * reach, marks = [];
    for (let i = 0; i < 36; i++) {
      const a = (Math.PI * i) / 18, inner = i % 3 ? 0.76 : 0.72;
      for (const r of [inner * reach, 0.8 * reach]) marks.push(new THREE.Vector3(r * Math.cos(a), r * Math.sin(a), z));
    }
    fixed.add(circle(0.8 * reach, z, line), circle(0.3 * reach, z, line), new THREE.LineSegments(new THREE.BufferGeometry().setFromPoints(marks), line));
    // A line on the base shows the direction in which the tank points.
    const pointer = new THREE.LineSegments(new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(0.3 * reach, 0, z), new THREE.Vector3(0.78 * reach, 0, z)]), paint(new THREE.LineBasicMaterial(), "bob"));
    root.add(pointer);
    return rotor;
  }

  // Draws a craft: a box and its axes, in front of a graticule of directions that do not turn.
  function craft({ size, center }, root, fixed, paint, reach) {
    const line = paint(new THREE.LineBasicMaterial(), "body");
    if (size) {
      const glass = paint(new THREE.MeshLambertMaterial({ transparent: true, opacity: 0.07, depthWrite: false, side: THREE.DoubleSide }), "body");
      const box = new THREE.Mesh(new THREE.BoxGeometry(...size), glass);
      box.position.fromArray(center || [0, 0, 0]);
      const edges = new THREE.LineSegments(new THREE.EdgesGeometry(box.geometry), line);
      edges.position.copy(box.position);
      root.add(box, edges);
    }
    const faint = paint(new THREE.LineBasicMaterial({ transparent: true, opacity: 0.55 }), "line");
    const far = 9 * reach;
    for (let i = 0; i < 6; i++) {
      const meridian = circle(far, 0, faint);
      meridian.rotation.set(Math.PI / 2, (Math.PI * i) / 6, 0);
      fixed.add(meridian);
    }
    for (const latitude of [-60, -30, 0, 30, 60]) {
      const a = (latitude * Math.PI) / 180;
      fixed.add(circle(far * Math.cos(a), far * Math.sin(a), faint));
    }
  }

  const style = `
.hs-scene { position: relative; overflow: hidden; min-height: 12rem; }
.hs-scene canvas { display: block; width: 100%; height: 100%; touch-action: none; outline: none; }
.hs-scene canvas:focus-visible { box-shadow: inset 0 0 0 2px var(--hs-ink); }
.hs-scene .hs-axis { position: absolute; left: 0; top: 0; font: 600 12px system-ui, sans-serif; color: var(--hs-ink); pointer-events: none; text-shadow: 0 0 3px var(--hs-paper), 0 0 3px var(--hs-paper); }
.hs-scene .hs-legend { position: absolute; left: .5rem; top: .5rem; margin: 0; padding: .3rem .55rem; list-style: none; font: 12px/1.5 system-ui, sans-serif; color: var(--hs-ink); background: var(--hs-panel); border-radius: 6px; pointer-events: none; max-width: calc(100% - 1rem); }
.hs-scene .hs-legend li { display: flex; gap: .45rem; align-items: center; white-space: nowrap; margin: 0; max-width: none; }
.hs-scene .hs-legend i { flex: none; width: 14px; height: 4px; border-radius: 2px; }
.hs-scene .hs-legend b { margin-left: auto; padding-left: .6rem; font-weight: 600; font-variant-numeric: tabular-nums; }
.hs-scene .hs-legend .hs-scale { color: var(--hs-soft); font-size: 11px; white-space: normal; max-width: 17rem; }
@media (max-width: 600px) { .hs-scene .hs-legend { font-size: 11px; line-height: 1.35; padding: .15rem .4rem; left: .25rem; top: .25rem; } .hs-scene .hs-legend .hs-scale { font-size: 10px; } }`;

  const digits = (value) => {
    const size = Math.abs(value);
    if (size === 0) return "0";
    if (size >= 1e4 || size < 1e-4) return value.toExponential(2).replace("-", "−").replace("e−", "e-");
    return value.toFixed(Math.max(0, Math.min(6, 2 - Math.floor(Math.log10(size))))).replace("-", "−");
  };

  function create(element, geometry, options = {}) {
    if (!document.getElementById("hs-style")) {
      const sheet = document.createElement("style");
      sheet.id = "hs-style";
      sheet.textContent = style;
      document.head.append(sheet);
    }
    const reach = geometry.reach;
    let renderer;
    try {
      renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
    } catch (error) {
      throw new Error("this browser shows no 3-D picture here: it has no WebGL, or it is switched off");
    }
    const canvas = renderer.domElement;
    element.classList.add("hs-scene");
    element.append(canvas);
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", options.label || "The motion in three dimensions. Arrow keys turn the view, plus and minus zoom, 0 shows all.");

    const scene = new THREE.Scene(), root = new THREE.Group(), fixed = new THREE.Group();
    scene.add(root, fixed);
    const painted = [];
    const paint = (material, color) => { painted.push([material, color]); return material; };
    const rotor = geometry.bench ? bench({ reach, ...geometry.bench }, root, fixed, paint) : (craft(geometry.body || {}, root, fixed, paint, reach), null);
    const tanks = geometry.tanks.map((data) => new Tank(data, reach));
    tanks.forEach((tank) => root.add(tank.group));

    // The axes of the body have letters.
    const letters = [];
    if (geometry.axes) {
      const length = geometry.axes.length, at = new THREE.Vector3().fromArray(geometry.axes.at || [0, 0, 0]);
      const ends = [[length, 0, 0], [0, length, 0], [0, 0, length]].map((end) => new THREE.Vector3().fromArray(end).add(at));
      root.add(new THREE.LineSegments(new THREE.BufferGeometry().setFromPoints(ends.flatMap((end) => [at, end])), paint(new THREE.LineBasicMaterial(), "ink")));
      ends.forEach((end, i) => {
        const span = document.createElement("span");
        span.className = "hs-axis";
        span.textContent = (geometry.axes.names || ["x", "y", "z"])[i];
        element.append(span);
        letters.push([span, end.clone().sub(at).multiplyScalar(1.08).add(at)]);
      });
    }

    const arrows = (geometry.arrows || []).map((data) => {
      const drawn = data.arc ? new Arc(data, reach) : new Arrow(data, reach);
      root.add(drawn.group);
      return { data, drawn };
    });
    const legend = document.createElement("ul");
    legend.className = "hs-legend";
    const shownColors = {};
    const rows = arrows.map(({ data }) => {
      const row = document.createElement("li"), swatch = document.createElement("i"), name = document.createElement("span"), value = document.createElement("b");
      name.textContent = data.label || data.name;
      row.append(swatch, name, value);
      legend.append(row);
      return { swatch, value };
    });
    if (arrows.length) {
      const row = document.createElement("li"), text = document.createElement("span");
      text.className = "hs-scale";
      const most = [...new Map(arrows.map(({ data }) => [data.kind + data.most, data])).values()];
      text.textContent = most.map((d) => `full ${d.arc ? "arc" : d.kind === "torque" ? "two-headed arrow" : "arrow"}: ${digits(d.most)}\u00a0${d.unit}`).join(", ");
      row.append(text);
      legend.append(row);
      element.append(legend);
    }

    scene.add(new THREE.AmbientLight(0xffffff, 1.7));
    const sun = new THREE.DirectionalLight(0xffffff, 1.9);
    scene.add(sun);
    const camera = new THREE.PerspectiveCamera(35, 1, 0.02 * reach, 60 * reach);
    camera.up.set(0, 0, 1);
    const target = new THREE.Vector3().fromArray(geometry.target || [0, 0, 0]);
    const direction = new THREE.Vector3().fromArray(geometry.from || [1, -1.25, 0.75]).normalize();
    const controls = new THREE.OrbitControls(camera, canvas);
    controls.enablePan = false;
    controls.minDistance = 0.3 * reach;
    controls.maxDistance = 14 * reach;
    controls.addEventListener("change", () => request());

    let width = 0, height = 0, asked = false, state = null, exaggeration = options.exaggeration ?? 1, frame = options.frame || "inertial";
    const dark = matchMedia("(prefers-color-scheme: dark)");

    // Height in pixels that the legend leaves for the picture. In a narrow element the picture is below the legend
    // instead of beside it.
    const NARROW = 600;
    let below = 0;
    const part = () => Math.min(width, below) / Math.max(height, 1);

    // Moves the camera so that the whole scene is in the picture, whatever the picture's proportions.
    function home() {
      const half = (camera.fov * Math.PI) / 360;
      const distance = (geometry.radius || reach) / Math.sin(Math.atan(Math.tan(half) * Math.min(1, part())));
      controls.target.copy(target);
      camera.position.copy(target).addScaledVector(direction, distance);
      controls.update();
    }

    function resize() {
      const [w, h] = [element.clientWidth, element.clientHeight];
      if (!w || !h || (w === width && h === height)) return;
      const first = !width, before = Math.min(1, part());
      [width, height] = [w, h];
      // The picture keeps at least half of the height even if the legend has many lines.
      below = w < NARROW ? Math.max(h - legend.offsetTop - legend.offsetHeight, h / 2) : h;
      renderer.setPixelRatio(Math.min(devicePixelRatio || 1, 2));
      renderer.setSize(w, h, false);
      camera.aspect = w / h;
      // This also updates the camera's projection.
      camera.setViewOffset(w, h, 0, (below - h) / 2, w, h);
      if (first) home();
      else camera.position.sub(controls.target).multiplyScalar(before / Math.min(1, part())).add(controls.target);
      draw();
    }

    function recolor() {
      const scheme = dark.matches ? "dark" : "light", colors = COLORS[scheme];
      painted.forEach(([material, color]) => material.color.set(colors[color]));
      tanks.forEach((tank) => tank.recolor(colors));
      arrows.forEach(({ data, drawn }, i) => {
        const color = (data.colors && data.colors[scheme]) || ARROWS[scheme][i % ARROWS[scheme].length];
        drawn.material.color.set(color);
        rows[i].swatch.style.background = color;
        shownColors[data.name] = color;
      });
      element.style.setProperty("--hs-ink", colors.ink);
      element.style.setProperty("--hs-soft", colors.soft);
      element.style.setProperty("--hs-paper", colors.paper);
      element.style.setProperty("--hs-panel", `${colors.paper}d9`);
      request();
    }

    function request() {
      if (asked) return;
      asked = true;
      requestAnimationFrame(() => { asked = false; draw(); });
    }

    function apply() {
      const q = state.q || [1, 0, 0, 0];
      const attitude = new THREE.Quaternion(q[1], q[2], q[3], q[0]).normalize();
      if (frame === "body") {
        root.quaternion.identity();
        fixed.quaternion.copy(attitude).invert();
      } else {
        root.quaternion.copy(attitude);
        fixed.quaternion.identity();
      }
      tanks.forEach((tank, i) => tank.draw(state.tanks[i], exaggeration));
      if (rotor) rotor.rotation.z = state.wheel || 0;
      arrows.forEach(({ data, drawn }, i) => {
        const value = state.arrows?.[data.name];
        if (value === undefined) { drawn.group.visible = false; return; }
        if (data.arc) {
          drawn.draw((value / (data.most || 1)) * data.arc.most);
          rows[i].value.textContent = `${digits(value)} ${data.unit}`;
        } else {
          const size = Math.hypot(...value);
          drawn.draw(value, (size / (data.most || 1)) * data.length);
          rows[i].value.textContent = `${digits(size)} ${data.unit}`;
        }
      });
    }

    function draw() {
      if (!width || !state) return;
      sun.position.copy(camera.position).add(new THREE.Vector3(0.3 * reach, 0.4 * reach, 1.5 * reach));
      renderer.render(scene, camera);
      for (const [span, at] of letters) {
        const seen = root.localToWorld(at.clone()).project(camera);
        span.style.transform = `translate(${((seen.x + 1) * width) / 2 - 4}px, ${((1 - seen.y) * height) / 2 - 8}px)`;
      }
    }

    canvas.addEventListener("keydown", (event) => {
      const offset = camera.position.clone().sub(controls.target), step = 0.08;
      let [radius, polar, azimuth] = [offset.length(), Math.acos(offset.z / offset.length()), Math.atan2(offset.y, offset.x)];
      switch (event.key) {
        case "ArrowLeft": azimuth -= step; break;
        case "ArrowRight": azimuth += step; break;
        case "ArrowUp": polar -= step; break;
        case "ArrowDown": polar += step; break;
        case "+": case "=": radius /= 1.1; break;
        case "-": radius *= 1.1; break;
        case "0": home(); event.preventDefault(); event.stopPropagation(); return;
        default: return;
      }
      polar = Math.max(0.02, Math.min(Math.PI - 0.02, polar));
      camera.position.set(Math.sin(polar) * Math.cos(azimuth), Math.sin(polar) * Math.sin(azimuth), Math.cos(polar)).multiplyScalar(radius).add(controls.target);
      controls.update();
      event.preventDefault();
      event.stopPropagation();
    });

    const observer = new ResizeObserver(resize);
    observer.observe(element);
    dark.addEventListener("change", recolor);
    recolor();
    resize();

    return {
      canvas,
      // Draws one instant immediately.
      show(next) { state = next; apply(); draw(); },
      set exaggeration(value) { exaggeration = value; if (state) { apply(); request(); } },
      get exaggeration() { return exaggeration; },
      // With "inertial" the craft turns and the directions stand still, with "body" it is the other way round.
      set frame(value) { frame = value; if (state) { apply(); request(); } },
      get frame() { return frame; },
      home() { home(); request(); },
      // The colours of the arrows by name, with which a page can draw the curve of the same quantity in the same colour.
      colors: shownColors,
      // Returns what is drawn, read from the meshes. For each tank and mode these are hinge and bob in the body's
      // frame, m. The surface above the tank's x axis and y axis is given as points (r, elevation), m, from the axis or
      // the inner wall outwards. Its elevation is exaggerated as in the picture, and its ends are those at the wall.
      read() {
        scene.updateMatrixWorld(true);
        const inBody = (mesh) => root.worldToLocal(mesh.getWorldPosition(new THREE.Vector3())).toArray();
        return tanks.map((tank, i) => {
          const position = tank.surface.geometry.attributes.position, level = state.tanks[i].level ?? tank.data.level;
          const section = (column) => Array.from({ length: tank.rings + 1 }, (_, k) => {
            const at = column * (tank.rings + 1) + k;
            return [Math.hypot(position.getX(at), position.getY(at)), position.getZ(at) - level];
          });
          const sections = tank.data.shape.box ? null : [section(0), section(AROUND / 4)];
          return {
            modes: tank.pendulums.map(({ hinge, bob }) => ({ hinge: inBody(hinge), bob: inBody(bob) })),
            level,
            sections,
            wall: sections && sections.map((points) => points[tank.rings][1]),
          };
        });
      },
      dispose() {
        observer.disconnect();
        dark.removeEventListener("change", recolor);
        controls.dispose();
        scene.traverse((thing) => { thing.geometry?.dispose(); thing.material?.dispose(); });
        renderer.dispose();
        element.replaceChildren();
        element.classList.remove("hs-scene");
      },
    };
  }

  return { create, cylinder, sphere, digits, ARROWS };
})();
