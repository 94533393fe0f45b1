// The column beside the scene: selection and its series, beliefs, events, layers, notes.

const PAUSE_MS = 200;

class Panel {
  constructor(app) {
    this.app = app;
    this.robot = document.querySelector("#pick-robot");
    this.topic = document.querySelector("#pick-topic");
    this.charts = [];
    this.#pickers();
    this.#layers();
    this.#notes();
    this.events = new EventList(document.querySelector("#events"), app);
    const beliefs = document.querySelector("#beliefs");
    const scene = app.scenes.find((each) => each.beliefs.knowsSees);
    beliefs.hidden = !scene || scene.run.hosts.length > 64;
    if (scene && app.runs.length > 1) {
      beliefs.querySelector("h2").textContent
        = `Who takes whom for online, run ${"AB"[app.scenes.indexOf(scene)]}`;
    }
    this.matrix = beliefs.hidden ? null : new Matrix(beliefs.querySelector("canvas"), scene, app);
    this.messages = new MessageList(document.querySelector("#messages"), app);
    this.selected();
  }

  #pickers() {
    const { app } = this, run = app.runs[0];
    fill(this.robot, ["all robots", ...run.robots]);
    fill(this.topic, ["all topics", ...run.about.families]);
    this.topic.hidden = run.about.families.length === 0;
    this.robot.onchange = () => {
      const robot = this.robot.selectedIndex - 1;
      app.select(robot < 0 ? {} : { kind: "robot", robot });
    };
    this.topic.onchange = () => {
      const family = this.topic.selectedIndex - 1;
      app.select(family < 0 ? {} : { kind: "family", family });
    };
  }

  // Build the series of what is selected now.
  selected() {
    const { app } = this, { selection } = app, run = app.runs[0];
    this.robot.selectedIndex = selection.kind === "robot" ? selection.robot + 1 : 0;
    this.topic.selectedIndex = selection.kind === "family" ? selection.family + 1 : 0;
    const pair = pairOf(run, selection);
    const title = pair ? pair.map((host) => run.hosts[host]).join(" ↔ ")
      : { robot: () => run.robots[selection.robot],
        family: () => run.about.families[selection.family] }[selection.kind]?.() ?? "The fleet";
    document.querySelector("#selection h2").textContent = title;
    document.querySelector("#clear").hidden = !selection.kind;
    const charts = chartsOf(app.scenes[0], selection, app.theme, app.runs.length === 1);
    if (app.runs.length > 1) this.#second(charts);
    this.charts = charts.map((chart) => new Chart(chart, () => app.changed()));
    document.querySelector("#charts").replaceChildren(...this.charts.map((one) => one.element));
    this.drawnMs = -Infinity;
  }

  // Take in what a run has got.
  refresh() {
    this.messages.refresh();
    this.selected();
  }

  // Lay the second run's lines, dashed, under those of the first.
  #second(charts) {
    const { app } = this, [one, other] = app.runs, { selection } = app;
    const found = translated(selection, one, other);
    if (selection.kind && !found.kind) return;
    const there = chartsOf(app.scenes[1], found, app.theme, false);
    for (const chart of charts) {
      const match = there.find((each) => each.title === chart.title);
      if (!match) continue;
      chart.lines = chart.lines.slice(0, 1);
      chart.lines.push({ ...match.lines[0], name: "B", dashed: true, colour: app.theme.soft });
    }
  }

  #layers() {
    const { app } = this, list = document.querySelector("#layers ul");
    list.replaceChildren();
    for (const [name, { words, isIn }] of Object.entries(LAYERS)) {
      if (!app.runs.some(isIn)) continue;
      const item = document.createElement("li");
      item.innerHTML = "<label><input type='checkbox'><span></span></label>";
      item.querySelector("span").textContent = words;
      const box = item.querySelector("input");
      box.name = name;
      box.checked = app.layers.has(name);
      box.addEventListener("change", () => app.switchLayer(name));
      list.append(item);
    }
    const kinds = new Set(app.runs.flatMap((run) => run.about.topic_kind));
    this.legend = [
      ...KINDS.map((text, kind) => [text, (theme) => theme.kinds[kind], kind]).filter(
        ([, , kind]) => kinds.has(kind)),
      ...[...new Set(app.scenes.flatMap((scene) => scene.terrain.materials))].map(
        (material) => [material, (theme) => theme.material(material)])];
    this.recolour();
  }

  // The key of colours that mean something: kinds of traffic, materials of walls.
  recolour() {
    document.querySelector("#legend").replaceChildren(...this.legend.map(([text, colour]) => {
      const item = document.createElement("i");
      item.style.setProperty("--key", colour(this.app.theme));
      item.textContent = text;
      return item;
    }));
  }

  #notes() {
    const list = document.querySelector("#notes ul"), { runs } = this.app;
    list.replaceChildren();
    const lines = runs.flatMap((run, which) => {
      const about = run.about, who = runs.length > 1 ? `${"AB"[which]}: ` : "";
      return [...about.notes.map((note) => who + note),
        ...(run.isLarge ? [`${who}more than ${MANY_ROBOTS} robots: laser fans, `
          + "plans and links are drawn of the selected robot only, loads of all, messages with key m"] : []),
        `${who}run ${about.run_id}, ${about.digest ? `digest ${about.digest}, ` : ""}`
          + `desim ${about.version}`];
    });
    if (runs.length > 1) lines.push("messages are listed of run A; dashed lines are those of run B");
    lines.push(`a message is seen for at least ${LEAST_FLIGHT_S} s, however short it was under way`);
    for (const line of lines) {
      const item = document.createElement("li");
      item.textContent = line[0].toUpperCase() + line.slice(1) + ".";
      list.append(item);
    }
  }

  // While it plays, five times a second.
  draw(ratio) {
    const now = performance.now();
    if (this.app.player.playing && now - this.drawnMs < PAUSE_MS) return;
    this.drawnMs = now;
    for (const chart of this.charts) chart.draw(this.app, ratio);
    this.matrix?.draw(ratio);
    this.messages.draw();
    this.events.draw();
  }
}

function fill(select, names) {
  select.replaceChildren(...names.map((name) => new Option(name)));
}
