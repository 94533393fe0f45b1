// Two runs beside each other: what they are called, what they have in common, and where they part.

const SEPARATOR = "  ·  ";

// The first instant at which a robot is elsewhere in the two runs, by more than a millimetre, and
// which one; null: all are at the same places as long as both go on.
function firstDifference(one, other) {
  const index = new Map(other.robots.map((name, robot) => [name, robot]));
  const pairs = one.robots.map((name, robot) => [robot, index.get(name)])
    .filter(([, there]) => there !== undefined);
  const a = one.pose.at, b = other.pose.at, count = Math.min(one.pose.length, other.pose.length);
  for (let i = 0; i < count; i++) {
    if (a.ns[i] !== b.ns[i]) return null;
    for (const [here, there] of pairs) {
      const away = Math.hypot(a.x_mm[here][i] - b.x_mm[there][i], a.y_mm[here][i] - b.y_mm[there][i]);
      if (away > 1) return { timeS: a.ns[i] / NS, robot: one.robots[here], awayM: away / 1000 };
    }
  }
  return null;
}

// The name of one of two runs: by name or seed where they differ, else by the keys of their
// scenarios, else as A and B.
function labelOf(runs, which) {
  const letter = "AB"[which], about = runs[which].about;
  const keys = [["name", (a) => a.name], ["seed", (a) => a.seed === null ? "imported" : `seed ${a.seed}`]];
  const apart = keys.filter(([key]) => new Set(runs.map((run) => run.about[key])).size > 1);
  const [first, ...more] = about.apart ?? [];
  const words = apart.map(([, text]) => text(about));
  if (!words.length && first) words.push(more.length ? `${shortKey(first)} …` : shortKey(first));
  return `${letter}: ${[...new Set(words.length ? words : [about.name])].join(", ")}`;
}

// "period 20 s" of "coordination.exchange.period 20 s".
function shortKey(text) {
  return text.replace(/^[^ ]*\./, "");
}

// What is known of one run, in words; of two what both have in common, then what they have not. An
// imported run has no scenario that could be compared.
function stateOf(runs) {
  const isImported = ({ about }) => about.status === "imported";
  const words = runs.map((run) => [...new Set([
    runs.some(({ about }) => about.name !== run.about.name) ? run.about.name : "",
    ...isImported(run) ? ["imported"] : ranAs(run.about),
    ...runs.some(isImported) ? [] : run.about.apart ?? []])].filter(Boolean));
  if (runs.length === 1) return words[0].join(SEPARATOR);
  const common = words[0].filter((word) => words[1].includes(word));
  const own = words.map((list, which) => `${"AB"[which]}: `
    + list.filter((word) => !common.includes(word)).join(", "));
  return [...common, own.join("  /  ")].join(SEPARATOR);
}

function ranAs(about) {
  const { status, stop_reason: why } = about, isPlain = status === "finished" || status === why;
  return [`seed ${about.seed}`, about.deployment, why, isPlain ? "" : status.toUpperCase(), about.error];
}
