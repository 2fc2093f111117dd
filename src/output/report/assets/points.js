"use strict";
// Points as squares in an image, with a depth for each pixel: no graphics card is needed.
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
  const packed = (rgb) => (255 << 24) | (rgb[2] << 16) | (rgb[1] << 8) | rgb[0];
  const TABLE = new Int32Array(256).map((_, k) => packed(colour(k / 255)));
  const GREY = packed([160, 160, 160]);

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
      const context = canvas.getContext("2d", { willReadFrequently: true });
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
      const image = context.getImageData(0, 0, w, h), pixels = new Int32Array(image.data.buffer);
      const depth = new Float32Array(w * h).fill(-Infinity);
      this.index = new Int32Array(w * h).fill(-1);
      const bounds = [...this.data.bounds, [0, 0]].slice(0, 3);
      const count = this.numbers("places", 0).length, places = this.data.bounds.map((_, axis) => this.numbers("places", axis));
      const values = this.numbers("values", this.field), all = this.data.columns[this.field].range, [low, high] = this.range();
      // From packed steps to the share of the colours' range.
      const gain = high > low ? (all[1] - all[0]) / 65534 / (high - low) : 0, offset = high > low ? (all[0] - low) / (high - low) : 0;
      const side = Math.max(Math.round(scale * this.data.size * 1.15), 2 * ratio | 0, 1), back = side >> 1;
      const steps = bounds.map(([a, b]) => (b - a) / 65534), start = bounds.map(([a], i) => a - middle[i]);
      let drawn = 0;
      for (let p = 0; p < count; p++) {
        const x = start[0] + steps[0] * places[0][p], y = start[1] + steps[1] * places[1][p];
        const z = this.flat ? 0 : start[2] + steps[2] * places[2][p];
        const sx = Math.round(at[0] + scale * (axes[0][0] * x + axes[0][1] * y + axes[0][2] * z)) - back;
        const sy = Math.round(at[1] - scale * (axes[1][0] * x + axes[1][1] * y + axes[1][2] * z)) - back;
        const near = axes[2][0] * x + axes[2][1] * y + axes[2][2] * z;
        if (sx >= w || sy >= h || sx + side <= 0 || sy + side <= 0) continue;
        drawn++;
        const share = values[p] * gain + offset;
        const paint = values[p] === 65535 ? GREY : TABLE[Math.min(Math.max(Math.round(share * 255), 0), 255)];
        for (let j = Math.max(sy, 0); j < Math.min(sy + side, h); j++) {
          for (let i = Math.max(sx, 0); i < Math.min(sx + side, w); i++) {
            const k = j * w + i;
            if (near >= depth[k]) { depth[k] = near; pixels[k] = paint; this.index[k] = p; }
          }
        }
      }
      context.putImageData(image, 0, 0);
      // Rigid bodies by the edges of their surfaces.
      const edges = this.data.frames[this.frame].edges;
      context.strokeStyle = "#222"; context.lineWidth = this.flat ? 2.5 * ratio : ratio;
      context.beginPath();
      for (let k = 0; k < edges.length; k += 6) {
        context.moveTo(...this.project(edges.slice(k, k + 3)));
        context.lineTo(...this.project(edges.slice(k + 3, k + 6)));
      }
      context.stroke();
      canvas.dataset.drawn = drawn;
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
    // The point at a place of the screen, or -1.
    at(x, y) {
      const box = this.canvas.getBoundingClientRect(), ratio = this.canvas.width / box.width;
      const [i, j] = [Math.floor((x - box.left) * ratio), Math.floor((y - box.top) * ratio)];
      return i >= 0 && j >= 0 && i < this.canvas.width && j < this.canvas.height ? this.index[j * this.canvas.width + i] : -1;
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
