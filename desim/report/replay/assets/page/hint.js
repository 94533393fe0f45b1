// What the mouse is over, in words beside it.

class Hint {
  constructor(element, stage) {
    this.stage = stage;
    this.text = document.createElement("p");
    this.text.className = "hint-text";
    this.text.hidden = true;
    element.after(this.text);
    this.place = null;  // client x and y of the mouse, and the pane below it
    element.addEventListener("pointermove", (event) => {
      this.place = event.pointerType === "mouse" && !event.buttons
        ? { x: event.clientX, y: event.clientY, element: event.target.closest(".pane") } : null;
      stage.app.changed();
    });
    element.addEventListener("pointerleave", () => { this.place = null; stage.app.changed(); });
  }

  draw() {
    const pane = this.place && this.stage.panes.find((each) => each.element === this.place.element);
    const words = pane ? this.#words(pane) : "";
    this.text.hidden = !words;
    this.stage.element.style.cursor = words ? "pointer" : "";
    if (!words) return;
    const box = this.stage.element.getBoundingClientRect();
    if (this.text.textContent !== words) this.text.textContent = words;
    const right = this.place.x - box.left > box.width - 190;
    this.text.style.transform = `translate(${this.place.x - box.left + (right ? -14 : 14)}px, `
      + `${this.place.y - box.top + 16}px) translateX(${right ? -100 : 0}%)`;
  }

  #words({ element, scene }) {
    const { camera, app } = this.stage, { run } = scene;
    const box = element.getBoundingClientRect(), timeS = Math.min(app.player.timeS, run.endS);
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
