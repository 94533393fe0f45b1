// What the mouse is over, in words beside it.

class Hint {
  constructor(element, stage) {
    this.stage = stage;
    this.text = document.createElement("p");
    this.text.className = "hint-text";
    this.text.hidden = true;
    element.after(this.text);
    this.place = null;  // client x and y of the mouse, and the view below it
    element.addEventListener("pointermove", (event) => {
      this.place = event.pointerType === "mouse" && !event.buttons
        ? { x: event.clientX, y: event.clientY, element: event.target.closest(".view") } : null;
      stage.app.changed();
    });
    element.addEventListener("pointerleave", () => { this.place = null; stage.app.changed(); });
  }

  draw() {
    const view = this.place && this.stage.views.find((each) => each.element === this.place.element);
    const words = view ? this.#words(view) : "";
    this.text.hidden = !words;
    this.stage.element.style.cursor = words ? "pointer" : "";
    if (!words) return;
    const box = this.stage.element.getBoundingClientRect();
    if (this.text.textContent !== words) this.text.textContent = words;
    const right = this.place.x - box.left > box.width - 190;
    this.text.style.transform = `translate(${this.place.x - box.left + (right ? -14 : 14)}px, `
      + `${this.place.y - box.top + 16}px) translateX(${right ? -100 : 0}%)`;
  }

  #words(view) {
    const { camera, app } = this.stage, [scene] = view.scenes, { run } = scene;
    const box = view.element.getBoundingClientRect(), timeS = Math.min(app.player.timeS, run.endS);
    const found = scene.pick(camera, timeS, this.place.x - box.left, this.place.y - box.top, 12, false);
    if (!found) return "";
    if (found.kind === "robot") return robotWords(run, found.robot, timeS);
    let rate = 0;
    scene.traffic.loads(timeS, (one, other, kind, bytesPerS) => {
      if ((one === found.one && other === found.other)
        || (one === found.other && other === found.one)) rate += bytesPerS;
    });
    return `${run.hosts[found.one]} ↔ ${run.hosts[found.other]}: ${quantity(rate, "B/s")}`;
  }
}

// robot_3: knows 45.2 %, 0.80 m/s.
function robotWords(run, robot, timeS) {
  const name = run.robots[robot];
  if (!run.isUp(robot, timeS)) return `${name}: its host is down`;
  const { us, explored, distance_m: way } = run.second.at;
  const at = countUpTo(us, timeS * 1e6) - 1;
  if (at < 1) return name;
  const speed = (way[robot][at] - way[robot][at - 1]) / 1000 / Math.max(1e-6, (us[at] - us[at - 1]) / 1e6);
  const share = explored[robot][at];  // negative: it has no software, or what it knew is not recorded
  if (share < 0 && run.about.status !== "imported") return name;
  return `${name}: ${share < 0 ? "" : `knows ${(share / 100).toFixed(1)} %, `}${speed.toFixed(2)} m/s`;
}
