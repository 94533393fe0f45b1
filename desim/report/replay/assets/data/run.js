// One run as the page has it. A stored run is one chunk; a source that is still running may append
// more: every table grows at its end, and everything that is drawn asks by time.

const NS = 1e9;
const MANY_ROBOTS = 100;  // so many are a large fleet

class Run {
  constructor(about) {
    this.about = about;
    this.robots = about.robots;
    this.hosts = about.hosts;
    this.startS = about.start_ns / NS;
    this.endS = about.end_ns / NS;
    this.pose = new Table("pose", ["ns", "x_mm", "y_mm", "yaw_mrad"],
      ["x_mm", "y_mm", "yaw_mrad"]);
    this.obstacle = new Table("obstacle", ["x_mm", "y_mm", "radius_mm"],
      ["x_mm", "y_mm", "radius_mm"]);
    this.message = new Table("message", ["number", "topic", "source", "destination", "size_bytes",
      "born_us", "left_us", "flight_us", "reason"]);
    this.load = new Table("load", ["bin", "source", "destination", "kind", "bytes"]);
    this.part = new Table("part", ["parts", "places", "ns"]);
    this.partCount = new Table("part", ["count"]);
    this.link = new Table("link", ["ns", "host", "other", "linked"]);
    this.sees = new Table("sees", ["ns", "believer", "other", "state"]);
    this.association = new Table("association", ["ns", "host", "access_point", "hangs"]);
    this.bump = new Table("bump", ["ns", "robot"]);
    this.plan = new Table("plan", ["ns", "host", "kind", "count"]);
    this.planPoint = new Table("plan", ["x_mm", "y_mm", "text"]);
    this.second = new Table("second", ["us", "union", "explored", "distance_m", "rx_bytes",
      "tx_bytes"], ["explored", "distance_m", "rx_bytes", "tx_bytes"]);
    this.computer = new Table("computer", ["busy_ms", "missed", "ram_kb"],
      ["busy_ms", "missed", "ram_kb"]);  // at the times of `second`
    this.topic = new Table("topic", ["bytes", "messages", "latency_us", "longest_us", "lost"],
      ["bytes", "messages", "latency_us", "longest_us", "lost"]);
    this.tables = [this.pose, this.obstacle, this.message, this.load, this.link, this.sees,
      this.association, this.bump, this.plan, this.planPoint, this.second, this.topic];
    this.events = [];
    this.growth = null;  // the last chunk with maps, which are decoded when they are shown
    this.hostOfRobot = this.robots.map((name) => this.hosts.indexOf(name));
    this.robotOfHost = this.hosts.map((name) => this.robots.indexOf(name));
    this.version = 0;
  }

  // Take what has happened since the last chunk.
  append(about, columns) {
    const changed = this.#joined(about);
    for (const table of this.tables) table.append(columns, changed[table.name]);
    this.message.sort("born_us");
    if (about.computers) this.computer.append(columns);
    if (about.ledger) {
      this.part.append(columns);
      this.partCount.append(columns);
      this.partStarts = starts(this.partCount.at.count);
    }
    const listed = new Set(this.events.map(keyOf));
    for (const [ns, kind, text, subjects] of about.events) {
      const event = { timeS: ns / NS, kind, text, subjects };
      if (!listed.has(keyOf(event))) this.events.push(event);
    }
    if (columns.has("wall.corners_mm")) this.walls = wallsOf(about, columns);
    if (about.growth) this.growth = { about: about.growth, columns };
    this.endS = Math.max(this.endS, about.end_ns / NS);
    this.partitions = about.partitions_s;
    this.lives = about.lives;
    this.#live();
    this.version += 1;
  }

  // Take over the words and figures of a later chunk. Its topics, families and reasons have other
  // numbers; returned is what changes these in its columns to those of this run.
  #joined(about) {
    const own = this.about;
    if (about === own) return {};
    const [topics, families, reasons, kinds, marks] =
      ["topics", "families", "reasons", "plan_kinds", "marks"].map((list) =>
        about[list].map((name) => numberOf(own[list], name)));
    topics.forEach((topic, k) => {
      own.topic_family[topic] = families[about.topic_family[k]];
      own.topic_kind[topic] = about.topic_kind[k];
    });
    for (const name of ["facts", "status", "stop_reason", "digest", "notes"]) own[name] = about[name];
    const through = (numbers) => ([row]) => [row.map((k) => numbers[k])];
    const byFamily = (rows) => own.families.map((_, family) => {
      const k = families.indexOf(family);
      return k < 0 ? new Int32Array(rows[0]?.length ?? 0) : rows[k];
    });
    return { message: { topic: through(topics), reason: through(reasons) },
      plan: { kind: through(kinds), text: through(marks) },
      topic: Object.fromEntries(Object.keys(this.topic.lists).map((name) => [name, byFamily])) };
  }

  // Index when robots' software starts and stops; 1 ns is for the rounding of times in seconds.
  #live() {
    this.changes = this.lives.flatMap(([robot, from, until]) => [{ ns: from - 1, robot, up: 1 },
      { ns: until === null ? Infinity : until + 1, robot, up: 0 }])
      .sort((a, b) => a.ns - b.ns || a.up - b.up);
    this.changeTimes = Float64Array.from(this.changes, (change) => change.ns);
    this.up = { robots: null, changes: -1 };
  }

  // By robot: 1 while its software runs (always, where its map was not recorded), else 0. `changes`
  // is another number after each change.
  upAt(timeS) {
    const changes = countUpTo(this.changeTimes, timeS * NS);
    if (changes !== this.up.changes) {
      const robots = new Uint8Array(this.robots.length).fill(1);
      for (const { robot } of this.changes) robots[robot] = 0;
      for (const { robot, up } of this.changes.slice(0, changes)) robots[robot] = up;
      this.up = { robots, changes };
    }
    return this.up;
  }

  // Whether the fleet is so large that laser fans, plans and links are those of the selected robot.
  get isLarge() { return this.robots.length > MANY_ROBOTS; }

  // Index of the last pose at or before the time, and how far it is to the next one, 0 to 1.
  poseIndex(timeS) {
    const times = this.pose.at.ns, count = this.pose.length, ns = Math.round(timeS * NS);
    if (count === 0) return [0, 0];
    const at = Math.max(0, countUpTo(times, ns, count) - 1);
    if (at >= count - 1) return [count - 1, 0];
    return [at, Math.max(0, (ns - times[at]) / (times[at + 1] - times[at]))];
  }

  // The parts of a message's time: what, where, how long; null: the run has not kept them.
  partsOf(k) {
    if (!this.partStarts || !this.partCount.at.count[k]) return null;
    const { parts, places, ns } = this.part.at, words = this.about.ledger;
    return Array.from({ length: this.partCount.at.count[k] }, (_, i) => {
      const at = this.partStarts[k] + i;
      return { part: words.parts[parts[at]], place: words.places[places[at]], s: ns[at] / NS };
    });
  }

  // The share of its processors that a robot had busy in the second that ends with this sample.
  busyShare(robot, second) {
    const { us } = this.second.at, busy = this.computer.at.busy_ms?.[robot];
    if (!busy || second < 1) return 0;
    const wholeMs = this.about.computers.processors[robot] * (us[second] - us[second - 1]) / 1000;
    return Math.min(1, (busy[second] - busy[second - 1]) / Math.max(1e-6, wholeMs));
  }

  // The standing walls' number: it changes when a door opens or closes.
  doorsAt(timeS) {
    this.doorTimes ??= [...new Set(this.walls.flatMap((wall) => [wall.fromS, wall.untilS]))]
      .sort((a, b) => a - b);
    return countUpTo(this.doorTimes, timeS);
  }

  // The corners of a robot's footprint, for a radius of 1; null for a disc.
  cornersOf(robot) {
    const { footprints, radius_m: radii } = this.about;
    return footprints?.[robot]?.map(([x, y]) => [x / radii[robot], y / radii[robot]]) ?? null;
  }

  // Discs that move by themselves: x [m], y [m], radius [m].
  obstaclesAt(timeS) {
    const [at, share] = this.poseIndex(timeS), { x_mm: xs, y_mm: ys, radius_mm: radii } = this.obstacle.at;
    return xs.map((x, k) => {
      const next = Math.min(at + 1, x.length - 1), y = ys[k];
      return [(x[at] + share * (x[next] - x[at])) / 1000, (y[at] + share * (y[next] - y[at])) / 1000,
        radii[k][at] / 1000];
    });
  }

  // Into `out`: x [m], y [m], yaw [rad] of every robot, between two samples on the straight line.
  posesAt(timeS, out = new Float64Array(3 * this.robots.length)) {
    const [at, share] = this.poseIndex(timeS), { x_mm: xs, y_mm: ys, yaw_mrad: yaws } = this.pose.at;
    for (let robot = 0; robot < this.robots.length; robot++) {
      const x = xs[robot], y = ys[robot], yaw = yaws[robot];
      let px = x[at], py = y[at], heading = yaw[at];
      if (share > 0) {
        px += share * (x[at + 1] - px);
        py += share * (y[at + 1] - py);
        let turn = yaw[at + 1] - heading;
        if (turn > 3141.6) turn -= 6283.185; else if (turn < -3141.6) turn += 6283.185;
        heading += share * turn;
      }
      out[3 * robot] = px / 1000;
      out[3 * robot + 1] = py / 1000;
      out[3 * robot + 2] = heading / 1000;
    }
    return out;
  }
}

// The number of a name in a list, which gets it if it has not.
function numberOf(list, name) {
  const at = list.indexOf(name);
  return at >= 0 ? at : list.push(name) - 1;
}

function keyOf(event) {
  return `${event.timeS} ${event.kind} ${event.text} ${event.subjects}`;
}

// The walls: metres, material, height, and from when until when they stand (doors come and go).
function wallsOf(about, columns) {
  const [x1, y1, x2, y2] = columns.rows("wall.corners_mm");
  const [material, height, from, until] = ["material", "height_mm", "from_ns", "until_ns"].map(
    (name) => columns.values(`wall.${name}`));
  return Array.from(x1, (_, i) => ({ x1: x1[i] / 1000, y1: y1[i] / 1000, x2: x2[i] / 1000,
    y2: y2[i] / 1000, material: about.terrain.materials[material[i]], heightM: height[i] / 1000,
    fromS: from[i] / NS, untilS: until[i] / NS }));
}

// The rectangle in m that the walls, the poses and the places of hosts need.
function boundsOf(run) {
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  const add = (x, y) => {
    box[0] = Math.min(box[0], x); box[1] = Math.min(box[1], y);
    box[2] = Math.max(box[2], x); box[3] = Math.max(box[3], y);
  };
  for (const wall of run.walls) { add(wall.x1, wall.y1); add(wall.x2, wall.y2); }
  run.robots.forEach((_, k) => {
    const x = run.pose.at.x_mm[k], y = run.pose.at.y_mm[k];
    for (let i = 0; i < x.length; i += 10) add(x[i] / 1000, y[i] / 1000);
  });
  for (const [x, y] of Object.values(run.about.places)) add(x, y);
  for (const { x_m: x, y_m: y } of run.about.access_points) add(x, y);
  return Number.isFinite(box[0]) ? box : [-1, -1, 1, 1];
}

// Where the entries of each begin, of lists that stand one behind the other.
function starts(counts) {
  let at = 0;
  return Float64Array.from(counts, (count) => (at += count) - count);
}

// The runs that stand in the page.
async function runsOfPage() {
  const abouts = [...document.querySelectorAll("script.run-about")];
  const blocks = [...document.querySelectorAll("script.run-columns")];
  return Promise.all(abouts.map(async (element, k) => {
    const about = JSON.parse(element.textContent), run = new Run(about);
    run.append(about, new Columns(about.columns, await inflated(blocks[k].textContent)));
    blocks[k].remove();  // its text is not needed any more
    return run;
  }));
}
