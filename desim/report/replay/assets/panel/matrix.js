// Who takes whom for online: a row for each believer, a column for each of the others.

const NAMES_PX = 30, HEADS_PX = 14;

class Matrix {
  constructor(canvas, scene, app) {
    Object.assign(this, { canvas, scene, app });
    this.extent = new Extent(canvas, () => app.changed());
    canvas.onclick = (event) => {
      const box = canvas.getBoundingClientRect(), cell = this.#cell(box.width);
      const row = Math.floor((event.clientY - box.top - HEADS_PX) / cell);
      const robot = this.scene.run.robotOfHost[row];
      if (row >= 0 && robot >= 0) this.app.select({ kind: "robot", robot });
    };
  }

  // The side of a cell, beside a column of names.
  #cell(width) {
    return (width - NAMES_PX) / this.scene.run.hosts.length;
  }

  draw(ratio) {
    const { beliefs, run } = this.scene, { theme } = this.app, { width } = this.extent.now();
    if (!width) return;
    const timeS = Math.min(this.app.player.timeS, run.endS), hosts = beliefs.hosts;
    const cell = this.#cell(width);
    const high = HEADS_PX + cell * hosts;
    beliefs.links.at(timeS);
    const seen = beliefs.sees.at(timeS);
    const chosen = this.app.selection.kind === "robot"
      ? run.hostOfRobot[this.app.selection.robot] : -1;
    const key = [beliefs.links.next, beliefs.sees.next, chosen, theme.name, width, ratio].join();
    if (key === this.key) return;
    this.key = key;
    this.canvas.style.height = `${high}px`;
    const context = sized(this.canvas, width, high, ratio);
    context.clearRect(0, 0, width, high);
    context.font = `${Math.min(10, cell * 0.66)}px ${theme.sans}`;
    context.textBaseline = "middle";
    for (let host = 0; host < hosts; host++) {
      context.fillStyle = host === chosen ? theme.ink : theme.soft;
      const name = shortName(run.hosts[host]).slice(0, 5);
      context.textAlign = "right";
      context.fillText(name, NAMES_PX - 5, HEADS_PX + (host + 0.5) * cell);
      context.textAlign = "center";
      if (name.length < 3) context.fillText(name, NAMES_PX + (host + 0.5) * cell, HEADS_PX / 2);
    }
    const gap = cell > 8 ? 1 : 0.5;
    for (let row = 0; row < hosts; row++) {
      for (let column = 0; column < hosts; column++) {
        const x = NAMES_PX + column * cell, y = HEADS_PX + row * cell;
        context.globalAlpha = chosen >= 0 && row !== chosen ? 0.45 : 1;
        if (row === column) continue;
        const state = seen[row * hosts + column];
        context.fillStyle = state === 1 ? theme.accent : state === 0 ? theme.rule : theme.faint;
        if (state === 0) context.globalAlpha *= 0.6;
        context.fillRect(x + gap, y + gap, cell - 2 * gap, cell - 2 * gap);
        const mistake = beliefs.mistake(row, column);
        if (mistake) {
          context.fillStyle = theme.alarm;
          context.beginPath();
          context.arc(x + cell / 2, y + cell / 2, cell * 0.22, 0, 2 * Math.PI);
          context.fill();
        }
      }
    }
    context.globalAlpha = 1;
  }
}
