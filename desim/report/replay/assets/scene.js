// The picture of one run at an instant, on any canvas: it knows nothing of the page around it.

const LAYERS = {
  map: "explored map", fans: "laser fans", paths: "paths", plans: "plans and goals",
  links: "links", loads: "load of links", messages: "messages", names: "names",
};
const MANY_ROBOTS = 100;  // beyond: laser fans and plans of the selected robot only

class Scene {
  constructor(run) {
    this.run = run;
    this.terrain = new Terrain(run);
    this.knowledge = run.growing.length ? new Knowledge(run) : null;
    this.traffic = new Traffic(run);
    this.beliefs = new Beliefs(run);
    this.network = new Network(run, this.traffic, this.beliefs);
    this.robots = new Robots(run);
    this.paths = new Paths(run);
    this.pictures = new Map();
    this.poses = new Float64Array(3 * run.robots.length);
  }

  // The rectangle that a camera should fit, in m.
  get bounds() {
    const [x0, y0, x1, y1] = this.terrain.bounds, spare = this.run.hosts.some((name, host) =>
      this.run.robotOfHost[host] < 0 && !this.run.about.places[name]);
    return [x0, y0 - (spare ? 0.06 * (y1 - y0) : 0), x1, y1];
  }

  // Draw all of it, or a ghost over another run. `options`: timeS, theme, ratio (device pixels a
  // pixel), speed, layers (a set of names), selection, ghost.
  draw(context, camera, options) {
    const view = { ...options, poses: this.run.posesAt(options.timeS, this.poses) };
    const { layers } = view, many = this.run.robots.length > MANY_ROBOTS;
    const chosen = view.selection.kind === "robot" ? view.selection.robot : null;
    const only = many ? chosen ?? -1 : null;
    this.network.placeHosts(view, this.terrain.bounds);
    if (!view.ghost) {
      context.fillStyle = view.theme.unknown;
      context.fillRect(0, 0, camera.width, camera.height);
      if (layers.has("map") && this.knowledge) this.#maps(context, camera, view, chosen);
    }
    if (!view.ghost) {
      this.terrain.at(view.timeS);
      if (layers.has("fans")) {
        this.robots.fans(context, camera, view, this.terrain.rays, chosen ?? only);
      }
      this.terrain.draw(context, camera, view.ratio, view.theme);
      this.robots.obstacles(context, camera, view);
    }
    if (layers.has("paths")) this.paths.draw(context, camera, view);
    if (!view.ghost) {
      if (layers.has("links")) this.network.links(context, camera, view);
      if (layers.has("loads")) this.network.loads(context, camera, view);
    }
    if (layers.has("plans")) this.robots.intents(context, camera, view, chosen ?? only);
    this.network.stations(context, camera, view);
    this.robots.bodies(context, camera, view);
    if (!view.ghost) {
      if (layers.has("messages")) this.network.messages(context, camera, view);
      this.network.views(context, camera, view);
      if (layers.has("names")) this.robots.names(context, camera, view);
    }
  }

  // The merged map; with a selected robot its own one, over a breath of what the others know.
  #maps(context, camera, view, chosen) {
    const { knowledge } = this, about = knowledge.about;
    const merged = this.#picture("merged", knowledge.merged, false, view.theme);
    merged.paint(Math.floor(10 * view.timeS + 1e-6));
    const own = chosen === null ? null : knowledge.ofRobot(chosen, view.timeS);
    drawMap(context, camera, about, merged, chosen === null ? 1 : 0.22);
    if (own) {
      const picture = this.#picture(`life ${own.key}`, own.map, true, view.theme);
      picture.paint(Math.floor(10 * (view.timeS - own.fromS) + 1e-6));
      drawMap(context, camera, about, picture);
    }
  }

  #picture(key, map, coarse, theme) {
    const full = `${theme.name} ${key}`;
    if (!this.pictures.has(full)) {
      if (this.pictures.size > 6) this.pictures.clear();
      this.pictures.set(full, new MapPicture(this.knowledge, map, coarse, theme,
        this.run.robots.length));
    }
    return this.pictures.get(full);
  }

  // The robot or link nearest to a point of the view, within reach of a finger; null: none. Links
  // without load only where they are asked for.
  pick(camera, timeS, sx, sy, reachPx, unloaded = true) {
    const poses = this.run.posesAt(timeS, this.poses);
    let best = null, least = reachPx;
    this.run.robots.forEach((_, robot) => {
      const away = Math.hypot(camera.sx(poses[3 * robot]) - sx, camera.sy(poses[3 * robot + 1]) - sy);
      if (away < least) { least = away; best = { kind: "robot", robot }; }
    });
    if (best) return best;
    least = Math.min(6, reachPx);
    this.network.placeHosts({ poses }, this.terrain.bounds);
    const near = (one, other) => {
      const away = distanceToLine(sx, sy, ...this.network.ends(camera, one, other));
      if (away < least) { least = away; best = { kind: "link", one, other }; }
    };
    this.traffic.loads(timeS, near);
    if (best || !unloaded) return best;
    this.beliefs.links.at(timeS);
    for (let one = 0; one < this.beliefs.hosts; one++) {
      for (let other = one + 1; other < this.beliefs.hosts; other++) {
        if (this.beliefs.linked(one, other)) near(one, other);
      }
    }
    return best;
  }
}

// The selection of one run in terms of another, by names; nothing where that has no such thing.
function translated(selection, from, to) {
  const same = (one, other, index) => other.indexOf(one[index]);
  if (selection.kind === "robot") {
    const robot = same(from.robots, to.robots, selection.robot);
    return robot < 0 ? {} : { kind: "robot", robot };
  }
  if (selection.kind === "topic") {
    const family = same(from.about.families, to.about.families, selection.family);
    return family < 0 ? {} : { kind: "topic", family };
  }
  const pair = pairOf(from, selection)?.map((host) => same(from.hosts, to.hosts, host));
  return !pair || pair.some((host) => host < 0) ? {} : { kind: "link", one: pair[0], other: pair[1] };
}

function distanceToLine(px, py, x1, y1, x2, y2) {
  const dx = x2 - x1, dy = y2 - y1, length = dx * dx + dy * dy || 1;
  const share = Math.max(0, Math.min(1, ((px - x1) * dx + (py - y1) * dy) / length));
  return Math.hypot(px - x1 - share * dx, py - y1 - share * dy);
}
