"use strict";
// Points as squares. OGL draws them by WebGL beside the page, and the picture is copied to the canvas, where lines are
// added. A browser without WebGL fills the squares one by one, those behind first.
const Points = (() => {
  // viridis (van der Walt and Smith, CC0) at 16 places.
  const VIRIDIS = [[68, 1, 84], [72, 26, 108], [71, 47, 125], [65, 68, 135], [57, 86, 140], [49, 104, 142], [42, 120, 142],
    [35, 136, 142], [31, 152, 139], [34, 168, 132], [53, 183, 121], [84, 197, 104], [122, 209, 81], [165, 219, 54],
    [210, 226, 27], [253, 231, 37]];
  const colour = (share) => {
    const at = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1);
    const k = Math.min(Math.floor(at), VIRIDIS.length - 2);
    return VIRIDIS[k].map((c, i) => Math.round(c + (at - k) * (VIRIDIS[k + 1][i] - c)));
  };
  const GREY = [160, 160, 160];

  // Places and values come as steps of 16 bits; 65535 is no number.
  const VERTEX = `#version 300 es
    in vec2 corner; in float x; in float y; in float z; in float v;
    uniform vec3 low, span; uniform mat3 turn; uniform vec2 at, scale, side; uniform float depth, gain, offset;
    out float share;
    void main() {
      vec3 p = turn * (low + span * vec3(x, y, z) * (65535.0 / 65534.0));
      gl_Position = vec4(at + scale * p.xy + side * corner, -p.z * depth, 1.0);
      share = v > 65534.5 / 65535.0 ? -1.0 : clamp(v * (65535.0 / 65534.0) * gain + offset, 0.0, 1.0);
    }`;
  const FRAGMENT = `#version 300 es
    precision highp float;
    in float share; uniform vec3 table[16]; out vec4 paint;
    void main() {
      float place = max(share, 0.0) * 15.0; int k = min(int(place), 14);
      paint = vec4(share < 0.0 ? vec3(0.627) : mix(table[k], table[k + 1], place - float(k)), 1.0);
    }`;

  // Draws squares by OGL; null without WebGL.
  const painter = () => {
    const canvas = document.createElement("canvas");
    if (!canvas.getContext("webgl2", { alpha: true, antialias: false })) return null;
    const renderer = new OGL.Renderer({ canvas, dpr: 1, alpha: true, antialias: false, webgl: 2 });
    const gl = renderer.gl, uniforms = {};
    for (const name of ["low", "span", "turn", "at", "scale", "side", "depth", "gain", "offset"]) uniforms[name] = { value: 0 };
    uniforms.table = { value: VIRIDIS.map((rgb) => rgb.map((c) => c / 255)) };
    const program = new OGL.Program(gl, { vertex: VERTEX, fragment: FRAGMENT, uniforms, cullFace: false });
    const square = new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]);
    let shown = "", mesh = null;
    // `key` names the arrays: they go to the card again when it changes.
    return (width, height, key, arrays, values) => {
      if (canvas.width !== width || canvas.height !== height) renderer.setSize(width, height);
      if (key !== shown) {
        mesh?.geometry.remove();
        const steps = (data) => ({ instanced: 1, size: 1, data, normalized: true });
        const [x, y, z, v] = arrays.map(steps);
        const geometry = new OGL.Geometry(gl, { corner: { size: 2, data: square }, x, y, z, v });
        mesh = new OGL.Mesh(gl, { geometry, program, mode: gl.TRIANGLE_STRIP, frustumCulled: false });
        shown = key;
      }
      for (const [name, value] of Object.entries(values)) uniforms[name].value = value;
      renderer.render({ scene: mesh, sort: false, frustumCull: false });
      return canvas;
    };
  };

  const unpack = (text) => {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const out = new Uint16Array(bytes.length / 2);
    for (let i = 0; i < out.length; i++) out[i] = bytes[2 * i] | (bytes[2 * i + 1] << 8);
    return out;
  };

  class View {
    constructor(canvas, data, lattice) {
      Object.assign(this, { canvas, data, lattice, frame: 0, field: 0, own: false, grid: true });
      this.flat = data.bounds.length === 2;
      this.cache = new Map();
      this.reset();
    }
    reset() {
      this.zoom = 1; this.shift = [0, 0];
      this.turn = this.flat ? [0, 0] : [-0.6, 0.45];
      this.draw();
    }
    numbers(kind, index) {
      const key = `${this.frame} ${kind} ${index}`;
      if (!this.cache.has(key)) {
        if (this.cache.size > 200) this.cache.clear();
        this.cache.set(key, unpack(this.data.frames[this.frame][kind][index]));
      }
      return this.cache.get(key);
    }
    range() {
      return this.own ? this.data.frames[this.frame].ranges[this.field] : this.data.columns[this.field].range;
    }
    value(index) {
      const [low, high] = this.data.columns[this.field].range;
      const step = this.numbers("values", this.field)[index];
      return step === 65535 ? NaN : low + (high - low) * step / 65534;
    }
    place(index) {
      return this.data.bounds.map(([low, high], axis) => low + (high - low) * this.numbers("places", axis)[index] / 65534);
    }
    // Rows of the rotation: across, up, towards the reader. z is up in space.
    axes() {
      if (this.flat) return [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
      const [a, b] = this.turn, [ca, sa, cb, sb] = [Math.cos(a), Math.sin(a), Math.cos(b), Math.sin(b)];
      return [[ca, sa, 0], [-sa * sb, ca * sb, cb], [sa * cb, -ca * cb, sb]];
    }
    scene() {
      const box = this.data.bounds.map((b) => [...b]);
      if (this.grid && this.lattice) {
        box.forEach((b, i) => {
          b[0] = Math.min(b[0], this.lattice.origin[i]);
          b[1] = Math.max(b[1], this.lattice.origin[i] + this.lattice.size[i]);
        });
      }
      while (box.length < 3) box.push([0, 0]);
      const middle = box.map(([a, b]) => (a + b) / 2), half = box.map(([a, b]) => (b - a) / 2);
      const axes = this.axes();
      const reach = axes.slice(0, 2).map((row) => row.reduce((sum, r, i) => sum + Math.abs(r) * half[i], 0) + this.data.size);
      return { middle, axes, reach, half };
    }
    draw() {
      const canvas = this.canvas, width = Math.max(canvas.clientWidth, 300);
      const { middle, axes, reach } = this.scene();
      const wanted = Math.min(Math.max(width * (reach[1] / reach[0] || 0.6), 220), 620);
      const ratio = Math.min(window.devicePixelRatio || 1, 2);
      const [w, h] = [Math.round(width * ratio), Math.round(wanted * ratio)];
      if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; canvas.style.height = `${wanted}px`; }
      const context = canvas.getContext("2d");
      const scale = 0.96 * this.zoom * Math.min(w / 2 / (reach[0] || 1), h / 2 / (reach[1] || 1));
      const at = [w / 2 + this.shift[0] * ratio, h / 2 + this.shift[1] * ratio];
      this.project = (x) => {
        const d = [0, 1, 2].map((i) => (x[i] || 0) - middle[i]);
        const on = (row) => row[0] * d[0] + row[1] * d[1] + row[2] * d[2];
        return [at[0] + scale * on(axes[0]), at[1] - scale * on(axes[1])];
      };
      context.fillStyle = "#fff";
      context.fillRect(0, 0, w, h);
      if (this.grid && this.lattice) this.lines(context, scale, ratio);
      const bounds = [...this.data.bounds, [0, 0]].slice(0, 3);
      const places = this.data.bounds.map((_, axis) => this.numbers("places", axis));
      const values = this.numbers("values", this.field), all = this.data.columns[this.field].range, [low, high] = this.range();
      const count = values.length;
      // From packed steps to the share of the colours' range.
      const gain = high > low ? (all[1] - all[0]) / (high - low) : 0, offset = high > low ? (all[0] - low) / (high - low) : 0;
      const side = Math.max(scale * this.data.size * 1.15, 2 * ratio, 1);
      const start = bounds.map(([a], i) => a - middle[i]), span = bounds.map(([a, b]) => b - a);
      this.shown = { places, start, span, axes, scale, at, side, count };
      this.painter = this.painter === undefined ? painter() : this.painter;
      if (this.painter) {
        const arrays = [...places, ...(this.flat ? [new Uint16Array(count)] : []), values];
        const deepest = span.reduce((sum, length) => sum + length, 0) || 1;
        context.drawImage(this.painter(w, h, `${this.frame} ${this.field}`, arrays, {
          low: start, span, turn: [0, 1, 2].flatMap((i) => axes.map((row) => row[i])),
          at: [(2 * at[0]) / w - 1, 1 - (2 * at[1]) / h], scale: [(2 * scale) / w, (2 * scale) / h],
          side: [side / w, side / h], depth: 1 / deepest, gain, offset,
        }), 0, 0);
      } else {
        const near = Float32Array.from({ length: count }, (_, p) => this.seen(p)[2]);
        const order = Uint32Array.from({ length: count }, (_, p) => p);
        if (!this.flat) order.sort((a, b) => near[a] - near[b]);
        for (const p of order) {
          const [x, y] = this.seen(p), share = (values[p] / 65534) * gain + offset;
          context.fillStyle = `rgb(${values[p] === 65535 ? GREY : colour(share)})`;
          context.fillRect(Math.round(x - side / 2), Math.round(y - side / 2), Math.ceil(side), Math.ceil(side));
        }
      }
      // Rigid bodies by the edges of their surfaces.
      const edges = this.data.frames[this.frame].edges;
      context.strokeStyle = "#222"; context.lineWidth = this.flat ? 2.5 * ratio : ratio;
      context.beginPath();
      for (let k = 0; k < edges.length; k += 6) {
        context.moveTo(...this.project(edges.slice(k, k + 3)));
        context.lineTo(...this.project(edges.slice(k + 3, k + 6)));
      }
      context.stroke();
      canvas.dataset.drawn = count;
      canvas.dataset.painter = this.painter ? "webgl" : "squares";
      canvas.dataset.frame = this.data.frames[this.frame].step;
      canvas.dataset.field = this.data.columns[this.field].name;
    }
    lines(context, scale, ratio) {
      const { origin, size, h } = this.lattice;
      context.strokeStyle = "#e1e5e9"; context.lineWidth = ratio;
      const line = (a, b) => {
        const [p, q] = [this.project(a), this.project(b)];
        context.beginPath(); context.moveTo(...p); context.lineTo(...q); context.stroke();
      };
      if (this.flat) {
        // Lines closer than a few pixels are a grey surface.
        const every = h.map((step) => Math.max(1, Math.ceil(5 * ratio / (scale * step))));
        for (let i = 0; i * h[0] <= size[0] * 1.000001; i += every[0])
          line([origin[0] + i * h[0], origin[1]], [origin[0] + i * h[0], origin[1] + size[1]]);
        for (let j = 0; j * h[1] <= size[1] * 1.000001; j += every[1])
          line([origin[0], origin[1] + j * h[1]], [origin[0] + size[0], origin[1] + j * h[1]]);
        return;
      }
      const corner = (k) => origin.map((o, i) => o + ((k >> i) & 1) * size[i]);
      for (let k = 0; k < 8; k++) for (let i = 0; i < 3; i++) if (!((k >> i) & 1)) line(corner(k), corner(k | (1 << i)));
    }
    // Pixels across and down, and the way towards the reader, of a point as it was drawn last.
    seen(p) {
      const { places, start, span, axes, scale, at } = this.shown;
      const d = [0, 1, 2].map((i) => start[i] + (places[i] ? (span[i] * places[i][p]) / 65534 : 0));
      const on = (row) => row[0] * d[0] + row[1] * d[1] + row[2] * d[2];
      return [at[0] + scale * on(axes[0]), at[1] - scale * on(axes[1]), on(axes[2])];
    }
    // The point at a place of the screen, or -1: of several the one in front.
    at(x, y) {
      const box = this.canvas.getBoundingClientRect(), ratio = this.canvas.width / box.width;
      const [i, j] = [(x - box.left) * ratio, (y - box.top) * ratio], half = this.shown.side / 2;
      let found = -1, front = -Infinity;
      for (let p = 0; p < this.shown.count; p++) {
        const [across, down, near] = this.seen(p);
        if (Math.abs(across - i) <= half && Math.abs(down - j) <= half && near >= front) [found, front] = [p, near];
      }
      return found;
    }
    move(dx, dy, turning) {
      if (turning && !this.flat) {
        this.turn = [this.turn[0] - dx / 150, Math.min(Math.max(this.turn[1] + dy / 150, -1.57), 1.57)];
      } else {
        this.shift = [this.shift[0] + dx, this.shift[1] + dy];
      }
      this.draw();
    }
    scaleBy(factor) {
      this.zoom = Math.min(Math.max(this.zoom * factor, 0.2), 200);
      this.shift = this.shift.map((s) => s * factor);
      this.draw();
    }
  }
  return { View, colour };
})();
