// The views of the runs: one, two side by side, or one with the other's ghosts; pan, zoom, pick.

class Stage {
  constructor(element, app) {
    this.element = element;
    this.app = app;
    this.camera = new Camera();
    this.pointers = new Map();
    this.moved = 0;
    this.followed = false;
    this.hint = new Hint(element, this);
    this.build();
    element.addEventListener("wheel", (event) => {
      event.preventDefault();
      const [x, y] = this.#inView(event);
      this.camera.zoomAt(x, y, Math.exp(-event.deltaY * (event.ctrlKey ? 0.01 : 0.0015)));
      app.changed();
    }, { passive: false });
    element.addEventListener("pointerdown", (event) => this.#down(event));
    element.addEventListener("pointermove", (event) => this.#move(event));
    element.addEventListener("pointerup", (event) => this.#up(event));
    element.addEventListener("pointercancel", (event) => this.pointers.delete(event.pointerId));
    element.addEventListener("dblclick", () => this.fit());
  }

  // Make the canvases that the mode needs.
  build() {
    const count = this.app.mode === "side" ? 2 : 1;
    this.views = Array.from({ length: count }, (_, k) => {
      const view = document.createElement("div");
      view.className = "view";
      view.innerHTML = '<canvas aria-hidden="true"></canvas><p class="caption"></p>';
      return { element: view, canvas: view.querySelector("canvas"),
        caption: view.querySelector(".caption") };
    });
    this.rewire();
    this.element.replaceChildren(...this.views.map((view) => view.element));
    this.fitted = 0;  // the width that the terrain was fitted to
  }

  // Show the app's scenes, which may have been made anew.
  rewire() {
    const { mode, scenes } = this.app;
    this.views.forEach((view, k) => { view.scenes = mode === "ghost" ? scenes : [scenes[k]]; });
  }

  fit() {
    const boxes = this.app.scenes.map((scene) => scene.bounds);
    this.followed = false;
    const side = this.camera.width < 500 ? 12 : 26;
    this.camera.fit([0, 1].map((k) => Math.min(...boxes.map((box) => box[k]))).concat(
      [2, 3].map((k) => Math.max(...boxes.map((box) => box[k])))), { side, top: 46, bottom: 30 });
    this.app.changed();
  }

  #inView(event) {
    const box = (event.target.closest?.(".view") ?? this.views[0].element).getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  #down(event) {
    if (event.button > 0) return;
    this.element.setPointerCapture(event.pointerId);
    const view = event.target.closest(".view");
    this.origin = (view ?? this.views[0].element).getBoundingClientRect();
    this.pressed = this.views.find((each) => each.element === view) ?? this.views[0];
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    if (this.pointers.size === 1) this.moved = 0;
  }

  #move(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    this.moved += Math.abs(now[0] - before[0]) + Math.abs(now[1] - before[1]);
    if (this.pointers.size === 1) {
      if (this.moved > 4) {
        this.followed = false;
        this.camera.pan(now[0] - before[0], now[1] - before[1]);
      }
    } else {
      const other = [...this.pointers].find(([id]) => id !== event.pointerId)[1];
      const far = (a) => Math.hypot(a[0] - other[0], a[1] - other[1]) || 1;
      this.camera.pan((now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
      this.camera.zoomAt((now[0] + other[0]) / 2 - this.origin.left,
        (now[1] + other[1]) / 2 - this.origin.top, far(now) / far(before));
    }
    this.pointers.set(event.pointerId, now);
    this.app.changed();
  }

  #up(event) {
    if (!this.pointers.delete(event.pointerId) || this.moved > 4 || this.pointers.size) return;
    const reach = event.pointerType === "touch" ? 24 : 14, scene = this.pressed.scenes[0];
    const found = scene.pick(this.camera, this.app.player.timeS, event.clientX - this.origin.left,
      event.clientY - this.origin.top, reach);
    this.app.select(found ? translated(found, scene.run, this.app.runs[0]) : {});
  }

  draw(ratio) {
    const { app } = this;
    for (const view of this.views) {
      const width = view.element.clientWidth, height = view.element.clientHeight;
      this.camera.resize(width, height);
      // A phone changes the height whenever its address bar comes and goes.
      if (this.fitted !== width && width > 1) { this.fit(); this.fitted = width; }
    }
    this.#follow();
    for (const view of this.views) {
      const context = sized(view.canvas, view.element.clientWidth, view.element.clientHeight, ratio);
      view.scenes.forEach((scene, k) => scene.draw(context, this.camera, {
        timeS: Math.min(app.player.timeS, scene.run.endS), theme: app.theme, ratio,
        speed: app.player.speed, layers: app.layers, ghost: k > 0,
        selection: scene.run === app.runs[0] ? app.selection
          : translated(app.selection, app.runs[0], scene.run) }));
      if (view.scenes.length > 1) this.#tethers(context, view.scenes);
      scaleBar(context, this.camera, app.theme);
      this.#caption(view);
    }
    this.hint.draw();
  }

  #follow() {
    const { selection, player } = this.app;
    if (!this.followed || selection.kind !== "robot") return;
    const poses = this.app.scenes[0].run.posesAt(player.timeS);
    this.camera.follow(poses[3 * selection.robot], poses[3 * selection.robot + 1]);
  }

  // From each robot to its ghost, where they are apart.
  #tethers(context, [one, other]) {
    const { app, camera } = this;
    const a = one.run.posesAt(Math.min(app.player.timeS, one.run.endS));
    const b = other.run.posesAt(Math.min(app.player.timeS, other.run.endS));
    context.save();
    context.lineWidth = 1;
    context.globalAlpha = 0.7;
    one.run.robots.forEach((name, robot) => {
      const there = other.run.robots.indexOf(name);
      if (there < 0) return;
      const away = Math.hypot(a[3 * robot] - b[3 * there], a[3 * robot + 1] - b[3 * there + 1]);
      if (away < 0.5) return;
      context.strokeStyle = robotColour(app.theme, robot);
      context.beginPath();
      context.moveTo(camera.sx(a[3 * robot]), camera.sy(a[3 * robot + 1]));
      context.lineTo(camera.sx(b[3 * there]), camera.sy(b[3 * there + 1]));
      context.stroke();
    });
    context.restore();
  }

  #caption(view) {
    const { app } = this, run = view.scenes[0].run, timeS = Math.min(app.player.timeS, run.endS);
    const parts = view.scenes[0].beliefs.knowsLinks ? view.scenes[0].beliefs.partsAt(timeS).parts : 1;
    const share = exploredAt(view.scenes[0], timeS);
    const name = app.runs.length > 1 ? view.scenes.map((scene, k) =>
      labelOf(app.runs, app.scenes.indexOf(scene)) + (k ? " (hollow)" : "")).join("  /  ") : "";
    const ended = app.player.timeS > run.endS + 1e-9 ? `ended at ${clock(run.endS)}` : "";
    const topic = app.selection.kind === "topic"
      ? `messages of ${app.runs[0].about.families[app.selection.family]}` : "";
    const text = [name, share === null ? "" : `${(share / 100).toFixed(1)} % explored`,
      parts > 1 ? `${parts} parts` : "", topic, ended].filter(Boolean).join("  ·  ");
    if (view.caption.textContent !== text) view.caption.textContent = text;
    view.caption.classList.toggle("split", parts > 1);
  }
}

// The share explored by all together, in hundredths of a percent; null: not recorded. Between two
// samples it grows as the cells do that are drawn. The first sample is of the instant before the
// first scans.
function exploredAt({ run, knowledge }, timeS) {
  const { us, union } = run.second.at, count = run.second.length;
  if (!count) return null;
  const at = Math.max(0, countUpTo(us, timeS * 1e6) - 1), share = union[at];
  if (share < 0) return null;
  if (!knowledge || at + 1 >= count || union[at + 1] <= share) return share;
  const cells = (s) => cellsBy(knowledge.merged, Math.floor(10 * s + 1e-6));
  const before = share ? cells(us[at] / 1e6) : 0, after = cells(us[at + 1] / 1e6);
  const grown = (cells(timeS) - before) / Math.max(1, after - before);
  return share + (union[at + 1] - share) * Math.max(0, Math.min(1, grown));
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
  return `${letter}: ${words.length ? words.join(", ") : about.name}`;
}

// "period 20 s" of "coordination.exchange.period 20 s".
function shortKey(text) {
  return text.replace(/^[^ ]*\./, "");
}

function scaleBar(context, camera, theme) {
  const wanted = 90 / camera.scale;
  const metres = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000].findLast(
    (length) => length <= wanted) ?? 0.1;
  const wide = metres * camera.scale, x = 16, y = camera.height - 16;
  context.save();
  context.strokeStyle = theme.soft;
  context.lineWidth = 1.5;
  context.beginPath();
  context.moveTo(x, y - 4); context.lineTo(x, y); context.lineTo(x + wide, y);
  context.lineTo(x + wide, y - 4);
  context.stroke();
  context.font = `11px ${FONT}`;
  context.textAlign = "left";
  context.textBaseline = "bottom";
  context.lineWidth = 3;
  context.strokeStyle = theme.unknown;
  context.strokeText(`${metres} m`, x + 5, y - 3);
  context.fillStyle = theme.soft;
  context.fillText(`${metres} m`, x + 5, y - 3);
  context.restore();
}
