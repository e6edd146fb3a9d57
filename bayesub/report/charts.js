// A chart of layers on axes that zoom: by dragging, by buttons, and by the keys + - 0 and the arrows.
const NARROWEST = 1e-6;

class Chart {
  // layers: {shape, colour, ...}; view: {x: [low, high], y: [low, high]}; linked: charts that share the x axis; of: the trial, if
  // there are several.
  constructor(box, { name, of = "", labels, height, layers, view, equal = false, downwards = false, locked = false, describe = null, linked = [] }) {
    Object.assign(this, { layers, equal, downwards, locked, linked, whole: view, view: structuredClone(view) });
    linked.push(this);
    this.name = of ? `${name}, ${of}` : name;
    const controls = make("div", { class: "controls" });
    for (const [sign, words, act] of [["+", "zoom in", () => this.scale(0.5)], ["\u2212", "zoom out", () => this.scale(2)],
      ["\u2190", "to the left", () => this.shift(-0.25, 0)], ["\u2192", "to the right", () => this.shift(0.25, 0)], ["all", "show all", () => this.reset()]]) {
      const button = make("button", { type: "button", "aria-label": `${this.name}: ${words}`, title: words }, sign);
      button.addEventListener("click", act);
      controls.append(button);
    }
    this.box = make("div", { class: "chart", tabindex: "0", role: "group" });
    box.append(make("div", { class: "titled" }, make("span", {}, name), controls), this.box);
    const axis = (label, size, space) => ({ label, size, space, labelSize: 20, values: (_, splits) => splits.map((v) => String(Number(v.toPrecision(6))).replace("-", "\u2212")), font: "12px system-ui", labelFont: "12px system-ui", labelGap: 0,
      stroke: () => colour("ink"), grid: { stroke: () => colour("line"), width: 1 }, ticks: { stroke: () => colour("line"), width: 1, size: 4 } });
    const options = {
      width: this.width, height, legend: { show: false }, padding: [8, 12, 0, 0],
      scales: { x: { time: false, range: () => this.view.x }, y: { range: () => this.view.y, dir: downwards ? -1 : 1 } },
      axes: [axis(labels[0], 28, 60), axis(labels[1], 58, Math.min(28, height / 6))],
      series: [{}, {}],
      cursor: { y: true, drag: { x: true, y: !locked, setScale: false, dist: 6 }, bind: { dblclick: () => () => this.reset() } },
      hooks: { drawAxes: [() => this.draw()], setSelect: [() => this.select()] },
    };
    this.plot = new uPlot(options, [[view.x[0], view.x[1]], [null, null]], this.box);
    this.show(this.view);
    new ResizeObserver(() => {
      this.plot.setSize({ width: this.width, height });
      queueMicrotask(() => this.show(this.asked)); // after the plot has its new size
    }).observe(this.box);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.plot.redraw());
    this.box.addEventListener("keydown", (event) => this.press(event));
    this.plot.over.addEventListener("pointermove", (event) => point(event, describe && describe(...this.under(event))));
    this.plot.over.addEventListener("pointerleave", (event) => point(event, ""));
  }

  get width() { return Math.max(200, this.box.clientWidth); }

  under(event) {
    const { left, top } = this.plot.over.getBoundingClientRect();
    return [this.plot.posToVal(event.clientX - left, "x"), this.plot.posToVal(event.clientY - top, "y")];
  }

  // Both axes at one scale where they are both metres: the wider view is kept.
  show({ x, y }) {
    this.asked = { x, y };
    if (this.equal) {
      const { width, height } = this.plot.bbox;
      const unit = Math.max((x[1] - x[0]) / width, (y[1] - y[0]) / height);
      const about = ([low, high], size) => [(low + high - unit * size) / 2, (low + high + unit * size) / 2];
      if (width && height) [x, y] = [about(x, width), about(y, height)];
    }
    this.view = { x, y };
    const [from, to] = x.map((value) => Number(value.toPrecision(5)));
    this.box.setAttribute("aria-label", `${this.name}, from ${from} to ${to}; plus and minus zoom, arrows move, 0 shows all`);
    this.plot.batch(() => { this.plot.setScale("x", { min: x[0], max: x[1] }); this.plot.setScale("y", { min: y[0], max: y[1] }); });
    this.plot.redraw();
  }

  zoom(view) {
    const { x } = this.whole;
    if (view.x[1] - view.x[0] < NARROWEST * (x[1] - x[0])) return;
    this.show(this.locked ? { x: view.x, y: this.whole.y } : view);
    for (const other of this.linked) if (other !== this) other.show({ x: view.x, y: other.view.y });
  }

  scale(factor) {
    const about = ([low, high]) => [(low + high - factor * (high - low)) / 2, (low + high + factor * (high - low)) / 2];
    this.zoom({ x: about(this.view.x), y: about(this.view.y) });
  }

  shift(right, up) {
    const moved = ([low, high], share) => [low + share * (high - low), high + share * (high - low)];
    this.zoom({ x: moved(this.view.x, right), y: moved(this.view.y, up) });
  }

  reset() { this.zoom(structuredClone(this.whole)); }

  press(event) {
    const up = this.downwards ? -0.25 : 0.25;
    const acts = { "+": () => this.scale(0.5), "=": () => this.scale(0.5), "-": () => this.scale(2), 0: () => this.reset(),
      ArrowLeft: () => this.shift(-0.25, 0), ArrowRight: () => this.shift(0.25, 0),
      ArrowUp: this.locked ? null : () => this.shift(0, up), ArrowDown: this.locked ? null : () => this.shift(0, -up) };
    if (event.ctrlKey || event.metaKey || event.altKey || !acts[event.key]) return;
    acts[event.key]();
    event.preventDefault();
  }

  select() {
    const { left, top, width, height } = this.plot.select;
    if (width < 6 && height < 6) return;
    const value = (place, axis) => this.plot.posToVal(place, axis);
    const y = [value(top + height, "y"), value(top, "y")].sort((a, b) => a - b);
    const x = [value(left, "x"), value(left + width, "x")];
    this.plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.zoom({ x: width < 6 ? this.view.x : x, y: height < 6 || this.locked ? this.view.y : y });
  }

  draw() {
    const { ctx, bbox } = this.plot;
    const at = (x, y) => [this.plot.valToPos(x, "x", true), this.plot.valToPos(y, "y", true)];
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    for (const layer of this.layers) {
      ctx.strokeStyle = ctx.fillStyle = colour(layer.colour);
      ctx.globalAlpha = layer.alpha ?? 1;
      ctx.lineWidth = (layer.width ?? 1.2) * devicePixelRatio;
      ctx.setLineDash(layer.dashed ? [4 * devicePixelRatio, 4 * devicePixelRatio] : []);
      Chart.shapes[layer.shape](ctx, at, layer, bbox);
    }
    ctx.restore();
  }

  static shapes = {
    line(ctx, at, { x, y }) {
      ctx.beginPath();
      let broken = true;
      x.forEach((value, k) => {
        if (y[k] === null || value === null) { broken = true; return; }
        ctx[broken ? "moveTo" : "lineTo"](...at(value, y[k]));
        broken = false;
      });
      ctx.stroke();
    },
    dots(ctx, at, { x, y, size = 1.6 }) {
      const radius = size * devicePixelRatio;
      ctx.beginPath();
      x.forEach((value, k) => {
        if (value === null || y[k] === null) return;
        const [left, top] = at(value, y[k]);
        ctx.moveTo(left + radius, top);
        ctx.arc(left, top, radius, 0, 2 * Math.PI);
      });
      ctx.fill();
    },
    band(ctx, at, { parts }) {
      for (const { x, low, high } of parts) {
        ctx.beginPath();
        x.forEach((value, k) => ctx.lineTo(...at(value, high[k])));
        for (let k = x.length - 1; k >= 0; k--) ctx.lineTo(...at(x[k], low[k]));
        ctx.closePath();
        ctx.fill();
        ctx.stroke();
      }
    },
    strip(ctx, at, { low, high }, bbox) {
      const [top, bottom] = [at(0, high)[1], at(0, low)[1]];
      ctx.fillRect(bbox.left, top, bbox.width, bottom - top);
    },
    // What holds 90 % of two independent normals of which x and y hold 90 % each.
    ellipse(ctx, at, { x, y }) {
      const [left, top] = at(x[0], y[1]);
      const [right, bottom] = at(x[1], y[0]);
      const wider = 2.146 / 1.645 / 2;
      ctx.beginPath();
      ctx.ellipse((left + right) / 2, (top + bottom) / 2, Math.abs(right - left) * wider, Math.abs(bottom - top) * wider, 0, 0, 2 * Math.PI);
      ctx.stroke();
    },
    cross(ctx, at, { x, y }, bbox) {
      const [left, top] = at(x, y);
      ctx.beginPath();
      ctx.moveTo(left, bbox.top);
      ctx.lineTo(left, bbox.top + bbox.height);
      ctx.moveTo(bbox.left, top);
      ctx.lineTo(bbox.left + bbox.width, top);
      ctx.stroke();
    },
  };
}
