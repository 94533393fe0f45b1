// The time series of what is selected. Each chart has a title, a unit and lines; a line has times, values.
function chartsOf(scene, selection, theme, alone) {
  const { run, traffic } = scene;
  if (selection.kind === "robot") return robotCharts(run, selection.robot, theme);
  const pair = pairOf(run, selection);
  if (pair) return linkCharts(run, traffic, pair, theme);
  if (selection.kind === "family") return familyCharts(run, selection.family, theme);
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
  if (run.about.computers && times.length) {
    const busy = run.robots.map((_, robot) => busyPercents(run, robot));
    charts.push({ title: "processors", unit: "%", max: 100, lines: [
      { name: "mean of the robots", colour: theme.accent, times,
        values: scaled(sumRows(busy), 1 / busy.length) },
      ...alone ? [{ name: "busiest", colour: theme.soft, times,
        values: times.map((_, i) => busy.reduce((most, row) => Math.max(most, row[i]), 0)) }] : []] });
  }
  const topic = run.topic.at;
  if (topic.bytes?.length) {
    const { hues } = theme, times_ = binTimes(topic.bytes[0].length);
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
    ...!run.about.computers ? [] : computerCharts(run, robot, colour, times, rate),
  ];
}

// What its processors and its memory did; the memory in % where it is limited.
function computerCharts(run, robot, colour, times, rate) {
  const { missed, ram_kb: kb } = run.computer.at, limitMB = run.about.computers.memory_mb[robot];
  return [
    { title: "processors", unit: "%", max: 100, lines: [
      { name: "busy", colour, times, values: busyPercents(run, robot) }] },
    ...!isRecorded(kb[robot]) ? [] : [{ title: "memory", lines: [{ name: "in use", colour, times,
      values: scaled(kb[robot], limitMB ? 0.1 / limitMB : 1e-3) }],
    ...limitMB ? { unit: "%", max: 100 } : { unit: "MB" } }],
    ...!missed[robot].some(Boolean) ? [] : [{ title: "missed ticks of timers", unit: "/s", lines: [
      { name: "missed", colour, times, values: rate(missed[robot], 1), steps: true }] }],
  ];
}

function busyPercents(run, robot) {
  return Array.from(run.second.at.us, (_, second) => 100 * run.busyShare(robot, second));
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

function familyCharts(run, family, theme) {
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
