// The network over the terrain: links, what they carry, messages under way, who believes in whom.

const FONT = 'system-ui, -apple-system, "Segoe UI", "Helvetica Neue", Arial, "DejaVu Sans", sans-serif';
const LEAST_FLIGHT_S = 0.45;   // of the viewer's time: a message is seen at least so long
const LOST_S = 0.7;            // likewise: the cross of a lost one
const MANY_HOSTS = 100;        // beyond: links of what is selected only
const LEVELS = 12, TOGETHER = 300;
const BELOW_TOPIC = 0.35;      // loads are of all topics: so pale below the messages of one
const FLASH_S = 1.5;           // of simulated time: a link that has just appeared or broken

class Network {
  constructor(run, traffic, beliefs) {
    Object.assign(this, { run, traffic, beliefs });
    this.places = new Float64Array(2 * run.hosts.length);
    this.waiting = new Map();  // by host: the messages that wait there, as drawn last
  }

  // Where every host is: on its robot, at its place, or beside the terrain.
  placeHosts(view, bounds) {
    const spare = [];
    for (let host = 0; host < this.run.hosts.length; host++) {
      const robot = this.run.robotOfHost[host], fixed = this.run.about.places[this.run.hosts[host]];
      if (robot >= 0) {
        this.places[2 * host] = view.poses[3 * robot];
        this.places[2 * host + 1] = view.poses[3 * robot + 1];
      } else if (fixed) {
        this.places.set(fixed, 2 * host);
      } else {
        spare.push(host);
      }
    }
    spare.forEach((host, k) => {
      const share = (k + 1) / (spare.length + 1);
      this.places[2 * host] = bounds[0] + share * (bounds[2] - bounds[0]);
      this.places[2 * host + 1] = bounds[1] - 0.045 * (bounds[3] - bounds[1]);
    });
  }

  // The ends of a link in pixels.
  ends(camera, one, other) {
    const at = this.places;
    return [camera.sx(at[2 * one]), camera.sy(at[2 * one + 1]),
      camera.sx(at[2 * other]), camera.sy(at[2 * other + 1])];
  }

  // Whether the selection leaves a pair of hosts in the light.
  #lit(view, one, other) {
    const chosen = view.selection;
    if (chosen.kind === "robot") {
      const host = this.run.hostOfRobot[chosen.robot];
      return one === host || other === host;
    }
    const pair = pairOf(this.run, chosen);
    return !pair || (one === pair[0] && other === pair[1]) || (one === pair[1] && other === pair[0]);
  }

  // Whether the selection leaves only some pairs of hosts in the light: a topic is everywhere.
  #isNarrow(view) {
    return view.selection.kind === "robot" || pairOf(this.run, view.selection) !== null;
  }

  // Links that are there, thin; those that appeared or broke a moment ago, flashing.
  links(context, camera, view) {
    const { beliefs } = this, hosts = beliefs.hosts;
    const pair = pairOf(this.run, view.selection);
    if (pair) this.#chosen(context, camera, view, ...pair);
    if (!beliefs.knowsLinks || (hosts > MANY_HOSTS && !this.#isNarrow(view))) return;
    beliefs.links.at(view.timeS);
    const quiet = Math.min(0.22, 2.2 / Math.max(6, hosts));
    const thin = new Path2D(), broken = [];
    const up = this.run.robotOfHost.map((robot) => robot < 0 || this.run.isUp(robot, view.timeS));
    for (let one = 0; one < hosts; one++) {
      for (let other = one + 1; other < hosts; other++) {
        if (!this.#lit(view, one, other) || !up[one] || !up[other]) continue;
        const there = beliefs.linked(one, other), pair = one * hosts + other;
        const changed = Math.max(beliefs.links.changedS[pair],
          beliefs.links.changedS[other * hosts + one]);
        const fresh = view.timeS - changed < FLASH_S && changed > this.run.startS + 0.01;
        if (!there && !fresh) continue;
        const [x1, y1, x2, y2] = this.ends(camera, one, other);
        if (fresh) broken.push([x1, y1, x2, y2, there, 1 - (view.timeS - changed) / FLASH_S]);
        if (there) { thin.moveTo(x1, y1); thin.lineTo(x2, y2); }
      }
    }
    context.save();
    context.strokeStyle = view.theme.soft;
    context.lineWidth = 0.8;
    context.globalAlpha = this.#isNarrow(view) ? 0.4 : quiet;
    context.stroke(thin);
    const dense = Math.min(1, 24 / Math.max(1, broken.length));
    for (const [x1, y1, x2, y2, there, share] of broken) {
      context.globalAlpha = share * (0.25 + 0.5 * dense);
      context.strokeStyle = there ? view.theme.accent : view.theme.alarm;
      context.lineWidth = 1.4;
      context.setLineDash(there ? [] : [4, 5]);
      context.beginPath();
      context.moveTo(x1, y1); context.lineTo(x2, y2);
      context.stroke();
    }
    context.restore();
  }

  #chosen(context, camera, view, one, other) {
    const [x1, y1, x2, y2] = this.ends(camera, one, other);
    context.save();
    context.globalAlpha = 0.3;
    context.setLineDash([]);
    context.lineCap = "round";
    context.strokeStyle = view.theme.accent;
    context.lineWidth = 10;
    context.beginPath();
    context.moveTo(x1, y1); context.lineTo(x2, y2);
    context.stroke();
    context.restore();
  }

  // Loads: the more bytes a second, the wider and the denser; colour by kind of traffic. Pairs of
  // about the same load are one path.
  loads(context, camera, view) {
    const pairs = new Map(), paths = new Map();
    this.traffic.loads(view.timeS, (source, destination, kind, rate) => {
      if (!this.#lit(view, source, destination)) return;
      const pair = source < destination ? source * 65536 + destination : destination * 65536 + source;
      const known = pairs.get(pair) ?? [0, kind, 0];
      known[0] += rate;
      if (rate > known[2]) { known[1] = kind; known[2] = rate; }
      pairs.set(pair, known);
    });
    for (const [pair, [rate, kind]] of pairs) {
      const [x1, y1, x2, y2] = this.ends(camera, pair >> 16, pair & 65535);
      const level = Math.round(LEVELS * loadShare(rate)) * KINDS.length + kind;
      if (!paths.has(level)) paths.set(level, []);
      paths.get(level).push(x1, y1, x2, y2);
    }
    const thinner = this.#isNarrow(view) ? 1 : Math.min(1, Math.sqrt(16 / Math.max(1, pairs.size)));
    const pale = view.selection.kind === "topic" ? BELOW_TOPIC : 1;
    context.save();
    context.lineCap = "round";
    for (const [level, lines] of paths) {
      const share = Math.floor(level / KINDS.length) / LEVELS;
      context.strokeStyle = view.theme.kinds[level % KINDS.length];
      context.globalAlpha = (0.15 + 0.5 * share) * thinner * pale;
      context.lineWidth = 0.5 + 4 * share * share * (0.4 + 0.6 * thinner);
      // Where lines of one path cross, they do not add up: few lines are drawn one by one.
      const together = lines.length > 4 * TOGETHER;
      if (together) context.beginPath();
      for (let i = 0; i < lines.length; i += 4) {
        if (!together) context.beginPath();
        context.moveTo(lines[i], lines[i + 1]);
        context.lineTo(lines[i + 2], lines[i + 3]);
        if (!together) context.stroke();
      }
      if (together) context.stroke();
    }
    context.restore();
  }

  // Messages as dots on their way; late ones have a ring, lost ones end as a cross. Those that wait
  // at their sender are a number there.
  messages(context, camera, view) {
    const { run, traffic, places } = this, at = run.message.at;
    const least = LEAST_FLIGHT_S * Math.max(0.25, view.speed);
    const after = LOST_S * Math.max(0.25, view.speed);
    const family = view.selection.kind === "topic" ? view.selection.family : -1;
    const dots = [], crosses = [], waiting = this.waiting = new Map();
    traffic.inFlight(view.timeS, least, after, (k, share, goneS) => {
      const source = at.source[k], destination = at.destination[k], lost = at.reason[k] > 0;
      if (!this.#lit(view, source, destination)) return;
      if (family >= 0 && run.about.topic_family[at.topic[k]] !== family) return;
      if (traffic.waits(k, view.timeS)) {
        waiting.set(source, (waiting.get(source) ?? 0) + 1);
        return;
      }
      const way = lost ? 0.5 * share : share;
      const x = camera.sx(places[2 * source] + way * (places[2 * destination] - places[2 * source]));
      const y = camera.sy(places[2 * source + 1]
        + way * (places[2 * destination + 1] - places[2 * source + 1]));
      if (lost && (share >= 1 || goneS > 0)) crosses.push([x, y, 1 - goneS / after]);
      else dots.push([x, y, k]);
    });
    const finer = Math.min(1, Math.sqrt(160 / Math.max(1, dots.length + crosses.length)));
    context.save();
    this.#dots(context, dots, finer, view);
    const chosen = view.selection.kind === "message"
      ? dots.find(([, , k]) => k === view.selection.message) : undefined;
    if (chosen) {
      context.strokeStyle = view.theme.ink;
      context.lineWidth = 2;
      context.beginPath();
      context.arc(chosen[0], chosen[1], 7, 0, 2 * Math.PI);
      context.stroke();
    }
    for (const [x, y, left] of crosses) {
      cross(context, x, y, 1.2 + 2 * finer, view.theme.alarm, left * (0.25 + 0.75 * finer));
    }
    this.#queues(context, camera, waiting, view);
    context.restore();
  }

  // Dots of one colour are one path, and so are the rings of late messages.
  #dots(context, dots, finer, view) {
    const at = this.run.message.at, paths = new Map(), rings = new Path2D();
    const none = view.theme.ink;
    for (const [x, y, k] of dots) {
      const radius = (1.1 + 0.3 * Math.log10(1 + at.size_bytes[k] / 100)) * (0.55 + 0.45 * finer);
      const robot = this.run.robotOfHost[at.source[k]];
      const colour = robot >= 0 ? robotColour(view.theme, robot) : none;
      if (!paths.has(colour)) paths.set(colour, new Path2D());
      circle(paths.get(colour), x, y, radius);
      if (view.timeS - at.born_us[k] / 1e6 >= LATE_S && this.traffic.isLate(k)) {
        circle(rings, x, y, radius + 0.6 + finer);
      }
    }
    context.globalAlpha = 0.95;
    for (const [colour, path] of paths) {
      context.fillStyle = colour;
      context.fill(path);
    }
    context.strokeStyle = view.theme.alarm;
    context.globalAlpha = 0.3 + 0.6 * finer;
    context.lineWidth = 0.5 + 0.6 * finer;
    context.stroke(rings);
  }

  // Messages that wait at a sender: an arc around it, a full circle for a thousand, and their
  // number where there is room.
  #queues(context, camera, waiting, view) {
    const taken = [], many = this.run.hosts.length > 100;
    context.font = `600 9px ${FONT}`;
    context.textAlign = "right";
    context.textBaseline = "middle";
    context.lineJoin = "round";
    context.lineCap = "butt";
    for (const [host, count] of [...waiting].sort((a, b) => b[1] - a[1])) {
      const x = camera.sx(this.places[2 * host]), y = camera.sy(this.places[2 * host + 1]);
      const radius = many ? 5 : 9, half = Math.PI * Math.min(1, Math.log10(1 + count) / 3);
      context.globalAlpha = 1;
      context.strokeStyle = view.theme.alarm;
      context.lineWidth = many ? 1 : 2;
      context.beginPath();
      context.arc(x, y, radius, Math.PI - half, Math.PI + half);
      context.stroke();
      if (many || taken.some(([tx, ty]) => Math.abs(tx - x) < 22 && Math.abs(ty - y) < 11)) continue;
      taken.push([x, y]);
      context.strokeStyle = view.theme.halo;
      context.lineWidth = 3;
      context.strokeText(count, x - radius - 3, y);
      context.fillStyle = view.theme.alarm;
      context.fillText(count, x - radius - 3, y);
    }
  }

  // Hosts without a body: a square with a name.
  stations(context, camera, view) {
    context.save();
    context.font = `500 11px ${FONT}`;
    context.textBaseline = "middle";
    for (let host = 0; host < this.run.hosts.length; host++) {
      if (this.run.robotOfHost[host] >= 0) continue;
      const x = camera.sx(this.places[2 * host]), y = camera.sy(this.places[2 * host + 1]);
      context.fillStyle = view.theme.ink;
      context.strokeStyle = view.theme.halo;
      context.lineWidth = 2;
      context.beginPath();
      context.roundRect(x - 6, y - 5, 12, 10, 2);
      context.stroke();
      context.fill();
      context.lineWidth = 3;
      context.strokeText(this.run.hosts[host], x + 11, y);
      context.fillText(this.run.hosts[host], x + 11, y);
    }
    context.restore();
  }

  // What the selected robot believes of the others: a mark beside each.
  views(context, camera, view) {
    if (view.selection.kind !== "robot" || !this.beliefs.knowsViews) return;
    const { beliefs } = this, believer = this.run.hostOfRobot[view.selection.robot];
    beliefs.links.at(view.timeS);
    beliefs.views.at(view.timeS);
    context.save();
    for (let other = 0; other < beliefs.hosts; other++) {
      if (other === believer) continue;
      const seen = beliefs.views.values[believer * beliefs.hosts + other];
      const x = camera.sx(this.places[2 * other]), y = camera.sy(this.places[2 * other + 1]) + 12;
      viewMark(context, x, y, seen, beliefs.mistake(believer, other), view.theme);
    }
    context.restore();
  }
}

function circle(path, x, y, radius) {
  path.moveTo(x + radius, y);
  path.arc(x, y, radius, 0, 2 * Math.PI);
}

// How wide a link's load is drawn, 0 to 1: from 10 B/s to 10 MB/s, by its logarithm.
function loadShare(rate) {
  return Math.max(0, Math.min(1, (Math.log10(rate + 1) - 1) / 6));
}

function cross(context, x, y, arm, colour, opacity) {
  context.globalAlpha = Math.max(0, opacity);
  context.strokeStyle = colour;
  context.lineWidth = 1.6;
  context.beginPath();
  context.moveTo(x - arm, y - arm); context.lineTo(x + arm, y + arm);
  context.moveTo(x - arm, y + arm); context.lineTo(x + arm, y - arm);
  context.stroke();
}

// Online: a full dot; gone: an open one with a bar; never seen: a small ring. A mistake has a ring.
function viewMark(context, x, y, seen, mistake, theme) {
  context.globalAlpha = 1;
  context.lineWidth = 1.4;
  context.strokeStyle = context.fillStyle = seen === 1 ? theme.accent : theme.soft;
  context.beginPath();
  context.arc(x, y, seen === 0 ? 1.6 : 3, 0, 2 * Math.PI);
  if (seen === 1) context.fill(); else context.stroke();
  if (seen >= 2) {
    context.beginPath();
    context.moveTo(x - 4, y + 4); context.lineTo(x + 4, y - 4);
    context.stroke();
  }
  if (mistake) {
    context.strokeStyle = theme.alarm;
    context.beginPath();
    context.arc(x, y, 6, 0, 2 * Math.PI);
    context.stroke();
  }
}
