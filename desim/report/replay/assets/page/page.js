// The page: it puts the parts together, and is the one that the parts ask for anything else.

class App {
  constructor(runs) {
    this.runs = runs;
    this.scenes = runs.map((run) => new Scene(run));
    this.player = new Player(runs);
    this.theme = themeOfPage(preferredTheme());
    this.layers = new Set(Object.keys(LAYERS).filter((name) => !LAYERS[name].isTooMuch?.(runs)));
    this.selection = {};
    this.mode = runs.length > 1 ? "side" : "single";
    this.difference = runs.length > 1 ? firstDifference(...runs) : null;
    this.frameMs = [];
    this.isLive = false;
    this.dirty = true;
    this.#head();
    this.stage = new Stage(document.querySelector("#stage"), this);
    this.timeline = new Timeline(document.querySelector("#timeline"), this);
    this.panel = new Panel(this);
    this.#controls();
    this.help = new Help(document.querySelector("#help"), this);
    listenToKeys(this);
    this.#begin();
    let before = performance.now();
    const loop = (now) => {
      const { playing } = this.player;  // the frame at which it stops is drawn, too
      this.player.advance((now - before) / 1000);
      before = now;
      if (playing || this.dirty) this.frame();
      requestAnimationFrame(loop);
    };
    requestAnimationFrame(loop);
  }

  changed() { this.dirty = true; }

  // Where the address says (#t=63.5); else it plays, in a page of its own and if motion is welcome.
  #begin() {
    const asked = /[#&]t=([\d.]+)/.exec(location.hash);
    if (asked) this.seek(Number(asked[1]));
    else if (window.top !== window || matchMedia("(prefers-reduced-motion: reduce)").matches) {
      this.seek(this.player.startS + 0.4 * (this.player.endS - this.player.startS));
    } else this.player.toggle();
  }

  // Draw everything once; the time that it took is kept for the benchmark.
  frame() {
    const began = performance.now(), ratio = Math.min(3, devicePixelRatio || 1);
    this.dirty = false;
    this.stage.draw(ratio);
    this.timeline.draw(ratio);
    this.panel.draw(ratio);
    this.#readout();
    this.frameMs.push(performance.now() - began);
    if (this.frameMs.length > 600) this.frameMs.shift();
  }

  seek(timeS) {
    this.player.leave();
    this.player.seek(timeS);
    this.changed();
  }

  // Take what has happened since the last chunk of a run.
  append(about, columns, which = 0) {
    const run = this.runs[which], known = run.events.length + run.about.families.length;
    run.append(about, columns);
    this.scenes[which] = new Scene(run);
    this.stage.rewire();
    this.#head();
    if (run.events.length + run.about.families.length > known) this.panel = new Panel(this);
    else this.panel.refresh();
    this.changed();
  }

  // To the end; of a run that goes on, wherever that is.
  toEnd() {
    if (this.isLive) this.player.follow();
    else this.seek(this.player.endS);
    this.changed();
  }

  // Chunks will come.
  goesOn() {
    this.isLive = true;
    this.player.follow();
  }

  // No more chunks will come.
  over() {
    this.player.end();
    this.isLive = false;
    this.changed();
  }

  faster(steps) {
    this.player.faster(steps);
    this.changed();
  }

  // To the next event (1) or the one before (-1).
  step(direction) {
    const { times } = this.panel.events, { timeS } = this.player;
    const found = direction > 0 ? times.find((time) => time > timeS + 1e-6)
      : times.findLast((time) => time < timeS - 1e-6);
    this.seek(found ?? (direction > 0 ? this.player.endS : this.player.startS));
  }

  select(selection) {
    this.selection = selection;
    if (selection.kind !== "robot") this.stage.followed = false;
    this.panel.selected();
    if (selection.kind === "message") this.#catch(selection.message);
    this.changed();
  }

  // Stop where the message is under way.
  #catch(message) {
    const { born_us: born, flight_us: flight } = this.runs[0].message.at, { timeS } = this.player;
    if (timeS * 1e6 < born[message] || timeS * 1e6 > born[message] + flight[message]) {
      this.seek((born[message] + flight[message]) / 1e6);
    }
    this.player.playing = false;
  }

  next(direction) {
    const count = this.runs[0].robots.length, { selection } = this;
    const at = selection.kind === "robot" ? selection.robot : direction > 0 ? -1 : 0;
    if (count) this.select({ kind: "robot", robot: (at + direction + count) % count });
  }

  follow() {
    if (this.selection.kind !== "robot") return;
    this.stage.followed = !this.stage.followed;
    if (this.stage.followed && this.stage.camera.scale < 16) {
      this.stage.camera.zoomAt(this.stage.camera.width / 2, this.stage.camera.height / 2,
        16 / this.stage.camera.scale);
    }
    this.changed();
  }

  switchMode(mode = this.mode === "side" ? "ghost" : "side") {
    if (this.runs.length < 2) return;
    this.mode = mode;
    document.querySelector("#mode").textContent = mode === "side" ? "ghosts" : "side by side";
    this.stage.build();
    this.changed();
  }

  switchLayer(name) {
    if (!this.layers.delete(name)) this.layers.add(name);
    const box = document.querySelector(`#layers input[name=${name}]`);
    if (box) box.checked = this.layers.has(name);
    this.changed();
  }

  switchTheme() {
    this.theme = themeOfPage(this.theme.name === "light" ? "dark" : "light");
    this.panel.selected();
    this.panel.recolour();
    this.help.draw();
    this.changed();
  }

  #head() {
    const about = this.runs[0].about, [a, b] = this.runs;
    document.querySelector("h1").textContent = !b ? about.name
      : a.about.name === b.about.name ? `${about.name}, two runs`
        : `${a.about.name} and ${b.about.name}`;
    document.title = `${this.runs.map((run) => run.about.name).join(" and ")} · desim replay`;
    const line = document.querySelector("#about");
    line.textContent = line.title = stateOf(this.runs);
    line.classList.toggle("bad", this.runs.some((run) => run.about.status === "failed"));
    document.querySelector("#facts").replaceChildren(...about.facts.map(([label, value]) => {
      const item = document.createElement("div");
      item.innerHTML = "<dt></dt><dd></dd>";
      item.querySelector("dt").textContent = label;
      const other = b?.about.facts.find(([name]) => name === label)?.[1];
      item.querySelector("dd").textContent = b && other !== value ? `${value} | ${other ?? "–"}` : value;
      return item;
    }));
  }

  #controls() {
    const on = (id, act) => document.querySelector(id).addEventListener("click", act);
    on("#play", () => { this.player.toggle(); this.changed(); });
    on("#before", () => this.step(-1));
    on("#after", () => this.step(1));
    on("#slower", () => this.faster(-1));
    on("#faster", () => this.faster(1));
    on("#fit", () => this.stage.fit());
    on("#mode", () => this.switchMode());
    on("#theme", () => this.switchTheme());
    on("#keys", () => this.help.open());
    on("#clear", () => this.select({}));
    document.querySelector("#mode").hidden = this.runs.length < 2;
  }

  // The clock and the speed, where they have changed.
  #readout() {
    const { timeS, endS, speed, playing } = this.player, now = clock(timeS);
    const shown = `${now} ${endS} ${speed} ${playing}`;
    if (shown === this.shown) return;
    this.shown = shown;
    const of = (id) => document.querySelector(id);
    of("#now").textContent = now;
    of("#end").textContent = clock(endS);
    of("#speed").textContent = `${speed}×`;
    of("#timeline").setAttribute("aria-valuenow", timeS.toFixed(1));
    of("#timeline").setAttribute("aria-valuetext", now);
    of("#play").classList.toggle("playing", playing);
    of("#play").setAttribute("aria-label", playing ? "pause" : "play");
  }
}

function preferredTheme() {
  return matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
}

// For tests and for pages around this one; docs/replay.md describes it.
function interfaceOf(app) {
  const run = (which) => app.runs[which];
  return {
    app,
    at(timeS) { app.player.playing = false; app.seek(timeS); app.frame(); return app.player.timeS; },
    time: () => app.player.timeS,
    playing: () => app.player.playing,
    span: () => [app.player.startS, app.player.endS],
    robots: (which = 0) => [...run(which).robots],
    positions: (which = 0) => {
      const flat = run(which).posesAt(Math.min(app.player.timeS, run(which).endS));
      return run(which).robots.map((_, robot) => [...flat.slice(3 * robot, 3 * robot + 3)]);
    },
    sonars: (which = 0) => {
      const timeS = Math.min(app.player.timeS, run(which).endS), poses = run(which).posesAt(timeS);
      return run(which).robots.map((_, robot) => run(which).about.sonars?.[robot]
        ? app.scenes[which].nearBy.readings(timeS, poses, robot).map(([, , , range]) => range) : null);
    },
    select: (selection) => app.select(selection),
    selection: () => ({ ...app.selection }),
    difference: () => app.difference,
    mode: (mode) => { if (mode) app.switchMode(mode); return app.mode; },
    draw: () => { app.frame(); return app.frameMs.at(-1); },
    async measured(speed, seconds) {
      Object.assign(app.player, { speed, playing: true });
      app.frameMs.length = 0;
      await new Promise((resolve) => setTimeout(resolve, 1000 * seconds));
      app.player.playing = false;
      return [...app.frameMs];
    },
    append: (about, columns, which = 0) => app.append(about, columns, which),
  };
}

const begun = document.querySelector(".run-about") ? runsOfPage().then((runs) => new App(runs))
  : streamed();
begun.then((app) => {
  window.desimReplay = interfaceOf(app);
  document.body.classList.add("ready");
}).catch((error) => {
  document.body.classList.add("failed");
  document.querySelector("#about").textContent = `This replay cannot be shown: ${error.message}`;
  throw error;
});
