// Figures and names, in words.

// 83.4 s, or 1:23.4 from a minute on.
function clock(timeS) {
  if (timeS < 0) return `-${clock(-timeS)}`;
  const tenths = Math.floor(timeS * 10 + 1e-6), minutes = Math.floor(tenths / 600);
  const seconds = (tenths - 600 * minutes) / 10;
  return minutes ? `${minutes}:${seconds.toFixed(1).padStart(4, "0")}` : `${seconds.toFixed(1)} s`;
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

// The short name of a host: robot_12 is 12.
function shortName(name) {
  const found = /^robot_(\d+)$/.exec(name);
  return found ? found[1] : name;
}

// "air at robot_3" is on air, at robot_3; other places are hosts.
function placeWords(place) {
  return place.includes(" at ") ? `on ${place.replace(" at ", ", at ")}` : place && `at ${place}`;
}

// robot_3: knows 45.2 %, 0.80 m/s, processors 97 % busy.
function robotWords(run, robot, timeS) {
  const name = run.robots[robot];
  if (!run.upAt(timeS).robots[robot]) return `${name}: its host is down`;
  const { us, explored, distance_m: way } = run.second.at;
  const at = countUpTo(us, timeS * 1e6) - 1;
  if (at < 1) return name;
  const speed = (way[robot][at] - way[robot][at - 1]) / 1000 / Math.max(1e-6, (us[at] - us[at - 1]) / 1e6);
  const busy = run.about.computers
    ? `, processors ${Math.round(100 * run.busyShare(robot, at))} % busy` : "";
  const share = explored[robot][at];  // negative: it has no software, or what it knew is not recorded
  if (share < 0 && run.about.status !== "imported") return name;
  return `${name}: ${share < 0 ? "" : `knows ${(share / 100).toFixed(1)} %, `}${speed.toFixed(2)} m/s${busy}`;
}
