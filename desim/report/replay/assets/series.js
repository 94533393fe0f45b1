// Time series of what is selected, in step with the scene: small charts, one below the other.

// The series of the selection: each chart has a title, a unit and lines; a line has times, values.
function chartsOf(scene, selection, theme, alone) {
  const { run, traffic } = scene;
  if (selection.kind === "robot") return robotCharts(run, selection.robot, theme);
  const pair = pairOf(run, selection);
  if (pair) return linkCharts(run, traffic, pair, theme);
  if (selection.kind === "topic") return topicCharts(run, selection.family, theme);
  return fleetCharts(scene, theme, alone);
}

// With another run beside it, one line a chart.
function fleetCharts(scene, theme, alone) {
  const { run } = scene, times = secondsOf(run), { explored, union } = run.second.at;
  const over = (fold, start) => times.map((_, i) => explored.reduce((value, row) =>
    row[i] < 0 ? value : fold(value, row[i]), start) / 100).map((v) => Number.isFinite(v) ? v : 0);
  const charts = [];
  if (hasShares(run)) {
    charts.push({ title: "explored", unit: "%", max: 100, lines: [
      { name: "all together", colour: theme.accent, times, values: scaled(union, 0.01),
        now: (timeS) => exploredAt(scene, timeS) / 100 },
      ...alone && explored.some(isRecorded) ? [
        { name: "best robot", colour: theme.soft, times, values: over(Math.max, 0) },
        { name: "least informed", colour: theme.faint, times, values: over(Math.min, Infinity) },
      ] : []] });
  }
  const topic = run.topic.at;
  if (topic.bytes?.length) {
    const hues = ROBOT_HUES[theme.name];
    const times_ = binTimes(topic.bytes[0].length);
    charts.push(alone ? { title: "delivered, by topic", unit: "B/s", log: true,
      lines: run.about.families.map((name, k) => ({ name, colour: hues[k % hues.length],
        times: times_, values: [...topic.bytes[k]], steps: true })) }
      : { title: "delivered", unit: "B/s", log: true, lines: [{ name: "all topics",
        colour: theme.accent, times: times_, values: sumRows(topic.bytes), steps: true }] });
    const lost = sumRows(topic.lost);
    if (lost.some((value) => value > 0)) {
      charts.push({ title: "messages lost", unit: "/s", lines: [{ name: "lost",
        colour: theme.alarm, times: binTimes(lost.length), values: lost, steps: true }] });
    }
  }
  return charts;
}

function robotCharts(run, robot, theme) {
  const times = secondsOf(run), at = run.second.at, colour = robotColour(theme, robot);
  const rate = (values, scale) => times.map((timeS, i) => i === 0 ? 0
    : scale * Math.max(0, values[i] - values[i - 1]) / Math.max(1e-6, timeS - times[i - 1]));
  const isSilent = run.about.status === "imported" && !run.about.families.length;
  return [
    ...!isRecorded(at.explored[robot]) ? [] : [{ title: "knows", unit: "%", max: 100, lines: [
      { name: "itself", colour, times, values: scaled(at.explored[robot], 0.01) },
      { name: "all together", colour: theme.faint, times, values: scaled(at.union, 0.01) }] }],
    { title: "speed", unit: "m/s", lines: [{ name: "speed", colour, times, values: rate(at.distance_m[robot], 1e-3) }] },
    ...isSilent ? [] : [{ title: "on the wire", unit: "B/s", log: true, lines: [
      { name: "received", colour, times, values: rate(at.rx_bytes[robot], 1)  },
      { name: "sent", colour: theme.soft, times, values: rate(at.tx_bytes[robot], 1) }] }],
  ];
}

function linkCharts(run, traffic, [one, other], theme) {
  const { there, back, stepS } = traffic.pairSeries(one, other);
  const times = binTimes(there.length, stepS), names = run.hosts.map(shortName);
  const at = run.message.at;
  const late = traffic.latencies((k) => (at.source[k] === one && at.destination[k] === other)
    || (at.source[k] === other && at.destination[k] === one));
  return [
    { title: "delivered", unit: "B/s", log: true, lines: [
      { name: `${names[one]} → ${names[other]}`, colour: theme.accent, times, values: [...there],
        steps: true },
      { name: `${names[other]} → ${names[one]}`, colour: theme.soft, times, values: [...back],
        steps: true }] },
    { title: "latency of each message", unit: "s", log: true, dots: true, lines: [
      { name: "latency", colour: theme.accent, times: late.map((one_) => one_.timeS),
        values: late.map((one_) => one_.value) }] },
  ];
}

function topicCharts(run, family, theme) {
  const at = run.topic.at, times = binTimes(at.bytes[family].length);
  const charts = [
    { title: "delivered", unit: "B/s", log: true, lines: [{ name: "bytes", colour: theme.accent,
      times, values: [...at.bytes[family]], steps: true }] },
    { title: "latency", unit: "s", log: true, dots: true, lines: [
      { name: "longest", colour: theme.alarm, times, values: scaled(at.longest_us[family], 1e-6) },
      { name: "mean", colour: theme.accent, times, values: scaled(at.latency_us[family], 1e-6) }] }];
  if (at.lost[family].some((value) => value > 0)) {
    charts.push({ title: "lost", unit: "/s", lines: [{ name: "lost", colour: theme.alarm, times,
      values: [...at.lost[family]], steps: true }] });
  }
  return charts;
}

// Whether shares are known at any time: one below 0 is not.
function isRecorded(shares) {
  return shares.some((share) => share >= 0);
}

function hasShares(run) {
  return run.second.length > 0 && isRecorded(run.second.at.union);
}

function secondsOf(run) {
  return run.second.length ? Array.from(run.second.at.us, (us) => us / 1e6) : [];
}

function binTimes(count, stepS = 1) {
  return Array.from({ length: count }, (_, k) => k * stepS);
}

function scaled(values, by) {
  return Array.from(values, (value) => value * by);
}

function sumRows(rows) {
  return Array.from(rows[0], (_, i) => rows.reduce((sum, row) => sum + row[i], 0));
}

// 12.3 kB/s, 4.5 ms, 97 %.
function quantity(value, unit) {
  if (unit === "%") return `${value.toFixed(1)} %`;
  if (unit === "s") {
    if (value >= 1) return `${value.toFixed(2)} s`;
    return value >= 1e-3 ? `${(1e3 * value).toFixed(1)} ms` : `${(1e6 * value).toFixed(0)} µs`;
  }
  for (const [factor, prefix] of [[1e9, "G"], [1e6, "M"], [1e3, "k"]]) {
    if (unit === "B/s" && value >= factor) return `${(value / factor).toFixed(1)} ${prefix}${unit}`;
  }
  return `${unit === "m/s" ? value.toFixed(2) : Math.round(value)} ${unit}`;
}

// One chart on its canvas: all of it faint, the part that has been shown strong.
class Chart {
  constructor(chart) {
    this.chart = chart;
    this.element = document.createElement("figure");
    this.element.className = "chart";
    this.element.innerHTML = "<figcaption><b></b><small></small><span></span></figcaption><canvas></canvas>";
    this.element.querySelector("b").textContent = chart.title;
    this.canvas = this.element.querySelector("canvas");
    this.layer = new Layer();
    const values = chart.lines.flatMap((line) => line.values.filter((v) => v > 0));
    this.most = chart.max ?? values.reduce((a, b) => Math.max(a, b), 1e-9);
    this.least = chart.log ? Math.min(values.reduce((a, b) => Math.min(a, b), Infinity),
      this.most / 10) : 0;
    this.element.querySelector("small").textContent = values.length
      ? `${chart.log ? quantity(this.least, chart.unit) : "0"} to ${quantity(this.most, chart.unit)}`
        + (chart.log ? ", logarithmic" : "") : "";
  }

  y(value, high) {
    const share = this.chart.log
      ? Math.log(Math.max(value, this.least) / this.least) / Math.log(this.most / this.least)
      : value / this.most;
    return high - 2 - (high - 6) * Math.max(0, Math.min(1, share));
  }

  draw(app, ratio) {
    const box = this.canvas.getBoundingClientRect(), { player, theme } = app;
    if (!box.width) return;
    const size = { width: box.width, height: box.height, version: 0 };
    const x = (timeS) => (timeS - player.startS) / Math.max(1e-9, player.endS - player.startS)
      * size.width;
    this.layer.kept(size, ratio, theme.name, (own) => this.#lines(own, x, size.height));
    const context = sized(this.canvas, box.width, box.height, ratio);
    context.clearRect(0, 0, box.width, box.height);
    this.layer.show(context, size);
    const now = x(player.timeS);
    context.fillStyle = alpha(theme.paper, 0.62);
    context.fillRect(now, 0, size.width - now, size.height);
    context.fillStyle = theme.ink;
    context.fillRect(now - 0.5, 0, 1, size.height);
    this.#caption(player.timeS);
  }

  #lines(context, x, high) {
    context.lineJoin = "round";
    for (const line of [...this.chart.lines].reverse()) {
      context.strokeStyle = context.fillStyle = line.colour;
      context.lineWidth = 1.4;
      context.setLineDash(line.dashed ? [4, 3] : []);
      context.beginPath();
      if (this.chart.dots) {
        line.times.forEach((timeS, i) => {
          if (line.values[i] > 0) context.rect(x(timeS) - 0.9, this.y(line.values[i], high) - 0.9, 1.8, 1.8);
        });
        context.fill();
        continue;
      }
      line.times.forEach((timeS, i) => {
        const py = this.y(line.values[i], high);
        if (i === 0) context.moveTo(x(timeS), py); else context.lineTo(x(timeS), py);
        if (line.steps && i + 1 < line.times.length) context.lineTo(x(line.times[i + 1]), py);
      });
      context.stroke();
    }
  }

  #caption(timeS) {
    const parts = this.chart.lines.slice(0, 8).map((line) => {
      const at = countUpTo(line.times, timeS) - 1, value = line.now?.(timeS) ?? (at < 0 ? 0 : line.values[at]);
      return [line, value];
    });
    const text = parts.map(([line, value]) =>
      `${line.name}|${quantity(Math.max(0, value), this.chart.unit)}|${line.colour}`).join("\n");
    if (text === this.text) return;
    this.text = text;
    this.element.querySelector("span").replaceChildren(...parts.map(([line, value]) => {
      const item = document.createElement("i");
      item.style.setProperty("--key", line.colour);
      item.textContent = `${line.name} ${quantity(Math.max(0, value), this.chart.unit)}`;
      return item;
    }));
  }
}
