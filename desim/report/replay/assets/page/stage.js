// The panes that show the runs: one, two side by side, or one with the other's ghosts; pan, zoom, pick.

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
      const [x, y] = this.#inPane(event);
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
    this.panes = Array.from({ length: count }, () => {
      const element = document.createElement("div");
      element.className = "pane";
      const sheets = new Sheets(element, SHEETS);
      const ghostSheets = this.app.mode === "ghost" ? new Sheets(element, GHOST_SHEETS) : null;
      element.append(sheets.layers.at(-1).canvas);  // names stay readable above ghosts
      const caption = document.createElement("p");
      caption.className = "caption";
      element.append(caption);
      return { element, sheets, ghostSheets, caption,
        extent: new Extent(element, () => this.app.changed()) };
    });
    this.rewire();
    this.element.replaceChildren(...this.panes.map((pane) => pane.element));
    this.fitted = 0;  // the width that the terrain was fitted to
  }

  // Show the app's scenes, which may have been made anew.
  rewire() {
    const { mode, scenes } = this.app;
    this.panes.forEach((pane, k) => {
      pane.scene = scenes[k];
      pane.ghost = mode === "ghost" ? new Ghost(scenes[1], scenes[0]) : null;
    });
  }

  fit() {
    const boxes = this.app.scenes.map((scene) => scene.bounds);
    this.followed = false;
    const side = this.camera.width < 500 ? 12 : 26;
    this.camera.fit([0, 1].map((k) => Math.min(...boxes.map((box) => box[k]))).concat(
      [2, 3].map((k) => Math.max(...boxes.map((box) => box[k])))), { side, top: 46, bottom: 30 });
    this.app.changed();
  }

  #inPane(event) {
    const box = (event.target.closest?.(".pane") ?? this.panes[0].element).getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  #down(event) {
    if (event.button > 0) return;
    this.element.setPointerCapture(event.pointerId);
    const element = event.target.closest(".pane");
    this.pressed = this.panes.find((pane) => pane.element === element) ?? this.panes[0];
    this.origin = this.pressed.element.getBoundingClientRect();
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
    const reach = event.pointerType === "touch" ? 24 : 14, { scene } = this.pressed;
    const found = scene.pick(this.camera, this.app.player.timeS, event.clientX - this.origin.left,
      event.clientY - this.origin.top, reach);
    this.app.select(found ? translated(found, scene.run, this.app.runs[0]) : {});
  }

  draw(ratio) {
    const { app } = this;
    for (const { extent } of this.panes) {
      const { width, height } = extent.now();
      this.camera.resize(width, height);
      // A phone changes the height whenever its address bar comes and goes.
      if (this.fitted !== width && width > 1) { this.fit(); this.fitted = width; }
    }
    this.#follow();
    for (const pane of this.panes) {
      pane.scene.draw(pane.sheets, this.camera, this.#shown(pane.scene, ratio));
      pane.ghost?.draw(pane.ghostSheets, this.camera, this.#shown(pane.ghost, ratio));
      this.#caption(pane);
    }
    this.hint.draw();
  }

  // What a scene, or a ghost, is to show.
  #shown({ run }, ratio) {
    const { app } = this;
    return { timeS: Math.min(app.player.timeS, run.endS), theme: app.theme, ratio,
      speed: app.player.speed, layers: app.layers, selection: run === app.runs[0] ? app.selection
        : translated(app.selection, app.runs[0], run) };
  }

  #follow() {
    const { selection, player } = this.app;
    if (!this.followed || selection.kind !== "robot") return;
    const poses = this.app.scenes[0].run.posesAt(player.timeS);
    this.camera.follow(poses[3 * selection.robot], poses[3 * selection.robot + 1]);
  }

  #caption({ scene, ghost, caption }) {
    const { app } = this, { run, beliefs } = scene, timeS = Math.min(app.player.timeS, run.endS);
    const parts = beliefs.knowsLinks ? beliefs.partsAt(timeS) : 1;
    const share = exploredAt(scene, timeS);
    const label = (one) => labelOf(app.runs, app.runs.indexOf(one.run));
    const name = app.runs.length < 2 ? ""
      : label(scene) + (ghost ? `  /  ${label(ghost)} (hollow)` : "");
    const ended = app.player.timeS > run.endS + 1e-9 ? `ended at ${clock(run.endS)}` : "";
    const family = app.selection.kind === "family"
      ? `messages of ${app.runs[0].about.families[app.selection.family]}` : "";
    const text = [name, share === null ? "" : `${(share / 100).toFixed(1)} % explored`,
      parts > 1 ? `${parts} parts` : "", family, ended].filter(Boolean).join(SEPARATOR);
    if (caption.textContent !== text) caption.textContent = text;
    caption.classList.toggle("split", parts > 1);
  }
}
