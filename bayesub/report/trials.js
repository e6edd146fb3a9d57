// Track and residuals of each trial, which zoom.
const GAP = 5; // intervals without a reading, over which nothing is joined

// Parts of a series between which nothing was read for long.
function parts(times) {
  const steps = times.slice(1).map((time, k) => time - times[k]);
  const usual = [...steps].sort((a, b) => a - b)[Math.floor(steps.length / 2)];
  const ends = steps.flatMap((step, k) => (step > GAP * usual ? [k + 1] : []));
  return [0, ...ends].map((from, k) => [from, ends[k] ?? times.length]);
}

function nearest(times, time) {
  let [low, high] = [0, times.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] < time) low = middle; else high = middle;
  }
  return time - times[low] < times[high] - time ? low : high;
}

for (const trial of content.trials) {
  widget(trial.figure, (box) => {
    const track = make("div");
    const residuals = make("div");
    const known = trial.path.truth ? [["reference", "truth"]] : [];
    box.append(make("div", { class: "beside" }, track, residuals),
      legend([["readings", "readings"], ["posterior", `posterior: ${trial.path.draws.length} tracks, 90 % band of residuals`], ...known, ["prior", "two noise sd"]]));
    if (trial.stride > 1) box.append(make("p", { class: "words" }, `Of ${trial.stride} readings one is drawn here.`));

    const of = trial.figure.slice("track_".length);
    const { labels, downwards } = trial.path;
    const paths = trial.path.draws.map((draw) => draw.map(unpack));
    const lines = paths.map(([x, y]) => ({ shape: "line", colour: "posterior", x, y }));
    const truth = trial.path.truth?.map(unpack);
    const readings = trial.path.readings?.map(unpack);
    const range = (k) => {
      const all = [...paths, ...(readings ? [readings] : [])].flatMap((path) => path[k]).filter((v) => v !== null);
      const [low, high] = all.reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity]);
      return [low - 0.05 * (high - low || 1), high + 0.05 * (high - low || 1)];
    };
    new Chart(track, {
      name: downwards ? "Track from aside" : "Track from above", of, labels, height: 420, equal: !downwards, downwards,
      layers: [
        ...(readings ? [{ shape: "dots", colour: "readings", x: readings[0], y: readings[1] }] : []), ...lines,
        ...(truth ? [{ shape: "line", colour: "ink", x: truth[0], y: truth[1], width: 0.8 }] : []),
        { shape: "dots", colour: "ink", x: [paths[0][0][0]], y: [paths[0][1][0]], size: 4 },
      ],
      view: { x: range(0), y: range(1) },
      describe: (x, y) => `${labels[0]} ${x.toFixed(2)}, ${labels[1]} ${y.toFixed(2)}`,
    });

    const linked = [];
    const height = Math.max(110, 400 / trial.channels.length - 26);
    const series = trial.channels.map(({ times }) => unpack(times));
    const last = Math.max(...series.map((times) => times[times.length - 1]));
    const below = trial.channels.length - 1;
    trial.channels.forEach(({ label, sd, lines: packed }, k) => {
      const times = series[k];
      const [residual, low, high, true_] = ["residual", "low", "high", "truth"].map((name) => packed[name] && unpack(packed[name]));
      const pieces = parts(times).map((part) => ({ x: times.slice(...part), low: low.slice(...part), high: high.slice(...part) }));
      new Chart(residuals, {
        name: `${label}, reading minus posterior mean`, of, labels: [k === below ? "time (s)" : null, null], height: height + (k === below ? 20 : 0), locked: true, linked,
        layers: [
          { shape: "strip", colour: "prior", alpha: 0.4, low: -2 * sd, high: 2 * sd },
          { shape: "dots", colour: "readings", x: times, y: residual },
          { shape: "band", colour: "posterior", parts: pieces },
          ...(true_ ? parts(times).map((part) => ({ shape: "line", colour: "ink", x: times.slice(...part), y: true_.slice(...part), width: 0.8 })) : []),
        ],
        view: { x: [-0.02 * last, 1.02 * last], y: [-4.2 * sd, 4.2 * sd] },
        describe: (time) => { const at = nearest(times, time); return `${times[at].toPrecision(5)} s: ${Number(residual[at]?.toPrecision(3))} ${(label.match(/\(.*\)/) ?? [""])[0].replace(/[()]/g, "")}`; },
      });
    });
  });
}
