// The picture of one run at an instant, on sheets: it knows nothing of the page around it.

// What can be switched off: its words, whether a run has any of it, and of which runs it is too much
// to begin with.
const LAYERS = {
  map: { words: "explored map", isIn: (run) => run.growth !== null },
  fans: { words: "laser fans", isIn: (run) => Boolean(run.about.lasers) },
  nearby: { words: "sonars and bumpers",
    isIn: ({ about }) => [about.sonars, about.bumpers].some((list) => list?.some(Boolean)) },
  busy: { words: "busy processors", isIn: (run) => Boolean(run.about.computers) },
  paths: { words: "paths", isIn: () => true },
  plans: { words: "plans and goals", isIn: (run) => run.plan.length > 0 },
  slam: { words: "believed poses", isIn: (run) => run.plan.at.kind?.includes(POSE) },
  links: { words: "links", isIn: (run) => run.link.length > 0 },
  wifi: { words: "access points", isIn: ({ about }) => about.access_points.length > 0 },
  loads: { words: "load of links", isIn: (run) => run.load.length > 0 },
  messages: { words: "messages", isIn: (run) => run.message.length > 0,
    isTooMuch: (runs) => runs.some((run) => run.isLarge) },
  names: { words: "names", isIn: () => true },
};
const SOLID = { hollow: false, dash: [], opacity: 1 };
const GHOSTLY = { hollow: true, dash: [3, 3], opacity: 0.6 };
const LABELS = new Labels();
const SHEETS = 7, GHOST_SHEETS = 3;

class Scene {
  constructor(run) {
    this.run = run;
    this.poses = new Float64Array(3 * run.robots.length);
    this.terrain = new Terrain(run);
    this.growth = run.growth ? new Growth(run) : null;
    this.traffic = new Traffic(run);
    this.beliefs = new Beliefs(run);
    this.hosts = new Hosts(run, this.terrain.bounds);
    this.loads = new Loads(run, this.hosts, this.traffic);
    this.flights = new Flights(run, this.hosts, this.traffic);
    this.plans = new Plans(run);
    this.nearBy = new NearBy(run, this.terrain);
    this.associations = run.about.access_points.length ? new Associations(run, this.hosts) : null;
    const { associations } = this, links = new Links(run, this.hosts, this.beliefs);
    // From the ground up, sheet by sheet: the layer (null: always drawn), and what draws it.
    this.sheets = [
      this.growth ? [["map", new Ground(run, this.growth)]] : [],
      [["fans", new Fans(run, this.terrain)]],
      [[null, this.terrain], ["paths", new Paths(run, SOLID)]],
      [["paths", new Trails(run, SOLID)]],
      [["links", links], ["loads", this.loads], ...associations ? [["wifi", associations]] : []],
      [["plans", this.plans]],
      [
        [null, new Obstacles(run)],
        ["slam", new BelievedPoses(run, this.plans)],
        ["links", new Flashes(links)],
        ["nearby", this.nearBy],
        [null, new Robots(run, SOLID)],
        ...run.about.computers ? [["busy", new BusyProcessors(run)]] : [],
        ...associations ? [["wifi", new AccessPoints(run, associations)]] : [],
        [null, this.hosts],
        ["messages", this.flights],
        ["messages", new Queues(run, this.hosts, this.flights)],
        [null, new Believed(run, this.hosts, this.beliefs)],
        ["names", new Names(run)],
        [null, new ScaleBar()],
      ],
    ];
  }

  // The rectangle that a camera should fit, in m.
  get bounds() {
    const [x0, y0, x1, y1] = this.terrain.bounds, spare = this.run.hosts.some((name, host) =>
      this.run.robotOfHost[host] < 0 && !this.run.about.places[name]);
    return [x0, y0 - (spare ? 0.06 * (y1 - y0) : 0), x1, y1];
  }

  // Draw all of it. `shown`: timeS, theme, ratio (device pixels a pixel), speed, layers (a set of
  // names), selection.
  draw(sheets, camera, shown) {
    sheets.draw(wanted(this.sheets, shown.layers), camera, this.view(camera, shown));
  }

  // What is shown, and where the robots and hosts are then: all that a drawing needs.
  view(camera, shown) {
    const poses = this.run.posesAt(shown.timeS, this.poses);
    this.hosts.follow(poses);
    return { ...shown, poses, labels: LABELS, version: this.run.version,
      up: this.run.upAt(shown.timeS), moves: this.hosts.movesOf(camera),
      selected: keyOfSelection(shown.selection),
      taken: [],  // rectangles of labels, which keep clear of each other
      chosen: shown.selection.kind === "robot" ? shown.selection.robot : -1 };
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
    this.hosts.follow(poses);
    const near = (one, other) => {
      const away = distanceToLine(sx, sy, ...this.hosts.ends(camera, one, other));
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

// A run's robots, hollow, over those of another: their ways, plans and bodies.
class Ghost {
  constructor(scene, other) {
    this.scene = scene;
    this.run = scene.run;
    this.sheets = [
      [["paths", new Paths(scene.run, GHOSTLY)]],
      [["paths", new Trails(scene.run, GHOSTLY)], ["plans", scene.plans]],
      [[null, scene.hosts], [null, new Robots(scene.run, GHOSTLY)],
        [null, new Tethers(scene, other)]],
    ];
  }

  draw(sheets, camera, shown) {
    sheets.draw(wanted(this.sheets, shown.layers), camera, this.scene.view(camera, shown));
  }
}

// The drawings whose layers are switched on.
function wanted(sheets, layers) {
  return sheets.map((drawings) => drawings.filter(([layer]) => layer === null || layers.has(layer))
    .map(([, drawing]) => drawing));
}
