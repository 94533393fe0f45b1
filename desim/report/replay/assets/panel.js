// The column beside the scene: selection and its series, beliefs, events, layers, notes.

class Panel {
  constructor(app) {
    this.app = app;
    this.robot = document.querySelector("#pick-robot");
    this.topic = document.querySelector("#pick-topic");
    this.charts = [];
    this.#pickers();
    this.#layers();
    this.#events();
    this.#notes();
    const beliefs = document.querySelector("#beliefs");
    const scene = app.scenes.find((each) => each.beliefs.knowsViews);
    beliefs.hidden = !scene || scene.run.hosts.length > 64;
    if (scene && app.runs.length > 1) {
      beliefs.querySelector("h2").textContent
        = `Who believes in whom, run ${"AB"[app.scenes.indexOf(scene)]}`;
    }
    this.matrix = beliefs.hidden ? null : new Matrix(beliefs.querySelector("canvas"), scene, app);
    this.messages = new Messages(document.querySelector("#messages"), app);
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
      app.select(family < 0 ? {} : { kind: "topic", family });
    };
  }

  // Build the series of what is selected now.
  selected() {
    const { app } = this, { selection } = app, run = app.runs[0];
    this.robot.selectedIndex = selection.kind === "robot" ? selection.robot + 1 : 0;
    this.topic.selectedIndex = selection.kind === "topic" ? selection.family + 1 : 0;
    const pair = pairOf(run, selection);
    const title = pair ? pair.map((host) => run.hosts[host]).join(" ↔ ")
      : { robot: () => run.robots[selection.robot],
        topic: () => run.about.families[selection.family] }[selection.kind]?.() ?? "The fleet";
    document.querySelector("#selection h2").textContent = title;
    document.querySelector("#clear").hidden = !selection.kind;
    const charts = chartsOf(app.scenes[0], selection, app.theme, app.runs.length === 1);
    if (app.runs.length > 1) this.#second(charts);
    this.charts = charts.map((chart) => new Chart(chart));
    document.querySelector("#charts").replaceChildren(...this.charts.map((one) => one.element));
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
    for (const [name, text] of Object.entries(LAYERS)) {
      const item = document.createElement("li");
      item.innerHTML = "<label><input type='checkbox'><span></span></label>";
      item.querySelector("span").textContent = text;
      const box = item.querySelector("input");
      box.name = name;
      box.checked = app.layers.has(name);
      box.addEventListener("change", () => {
        if (box.checked) app.layers.add(name); else app.layers.delete(name);
        app.changed();
      });
      list.append(item);
    }
    const kinds = new Set(app.runs.flatMap((run) => run.about.topic_kind));
    this.legend = [
      ...KINDS.map((text, kind) => [text, (theme) => theme.kinds[kind], kind]).filter(
        ([, , kind]) => kinds.has(kind)),
      ...[...new Set(app.scenes.flatMap((scene) => scene.terrain.materials))].map(
        (material) => [material, (theme) => theme.materials[material] ?? theme.wall])];
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

  #events() {
    const { app } = this, list = document.querySelector("#events ol");
    list.replaceChildren();
    this.items = [];
    const all = app.runs.flatMap((run, which) => run.events.map((event) => ({ ...event, which })));
    if (app.difference) {
      all.push({ timeS: app.difference.timeS, kind: "difference", which: null,
        text: `first difference: ${app.difference.robot} is `
          + `${Math.round(1000 * app.difference.awayM)} mm elsewhere`,
        subjects: [app.difference.robot] });
    }
    all.sort((a, b) => a.timeS - b.timeS);
    this.events = all;
    for (const event of all) {
      const item = document.createElement("li"), button = document.createElement("button");
      button.innerHTML = "<time></time><i></i><span></span>";
      button.querySelector("time").textContent = clock(event.timeS);
      button.querySelector("i").textContent = EVENT_GLYPHS[event.kind] ?? "·";
      const run = app.runs.length > 1 && event.which !== null ? `${"AB"[event.which]}: ` : "";
      button.querySelector("span").textContent = run + event.text;
      button.classList.toggle("bad", BAD.has(event.kind));
      button.addEventListener("click", () => {
        app.seek(event.timeS);
        const robot = app.runs[0].robots.indexOf(event.subjects[0]);
        if (robot >= 0) app.select({ kind: "robot", robot });
      });
      item.append(button);
      list.append(item);
      this.items.push(item);
    }
    document.querySelector("#events").hidden = all.length === 0;
  }

  #notes() {
    const list = document.querySelector("#notes ul"), { runs } = this.app;
    list.replaceChildren();
    const lines = runs.flatMap((run, which) => {
      const about = run.about, who = runs.length > 1 ? `${"AB"[which]}: ` : "";
      return [...about.notes.map((note) => who + note),
        ...(run.robots.length > MANY_ROBOTS ? [`${who}more than ${MANY_ROBOTS} robots: laser fans, `
          + "plans and links are drawn of the selected robot only; loads and messages of all"] : []),
        `${who}run ${about.run_id}, ${about.digest ? `digest ${about.digest}, ` : ""}`
          + `desim ${about.version}`];
    });
    if (runs.length > 1) lines.push("messages are listed of run A; dashed lines are those of run B");
    lines.push("a message is seen for at least half a second, however short it was under way");
    for (const line of lines) {
      const item = document.createElement("li");
      item.textContent = line[0].toUpperCase() + line.slice(1) + ".";
      list.append(item);
    }
  }

  draw(ratio) {
    for (const chart of this.charts) chart.draw(this.app, ratio);
    this.matrix?.draw(ratio);
    this.messages.draw();
    this.#mark();
  }

  // Mark the last event that has happened.
  #mark() {
    let at = -1;
    const { timeS } = this.app.player;
    while (at + 1 < this.events.length && this.events[at + 1].timeS <= timeS + 1e-9) at += 1;
    if (at === this.marked) return;
    this.items[this.marked]?.classList.remove("now");
    this.items[at]?.classList.add("now");
    this.marked = at;
    const list = document.querySelector("#events ol"), item = this.items[at];
    if (list.scrollHeight > list.clientHeight) {
      list.scrollTop = item ? item.offsetTop - list.offsetTop - list.clientHeight / 2 : 0;
    }
  }
}

function fill(select, names) {
  select.replaceChildren(...names.map((name) => new Option(name)));
}
