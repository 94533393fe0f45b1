// The terrain: walls in the colours of their materials, and the shadows that their heights throw.

const SUN = [0.34, -0.42];  // metres of shadow for a metre of height

class Terrain {
  constructor(run) {
    this.run = run;
    this.bounds = boundsOf(run);
    this.doors = -1;
  }

  get materials() {
    return [...new Set(this.run.walls.map((wall) => wall.material))];
  }

  // The walls that stand at the time.
  at(timeS) {
    const doors = this.run.doorsAt(timeS);
    if (doors !== this.doors) {
      this.doors = doors;
      this.walls = this.run.walls.filter((wall) => wall.fromS <= timeS && timeS < wall.untilS);
      this.rays = new Map();  // by the number of walls that are high enough
    }
    return this;
  }

  // The way of beams at a height through the walls that stand at the time: lower ones are not met.
  raysAt(timeS, heightM) {
    const met = this.at(timeS).walls.filter((wall) => wall.heightM > heightM);
    if (!this.rays.has(met.length)) this.rays.set(met.length, new Rays(met));
    return this.rays.get(met.length);
  }

  key(view) {
    this.at(view.timeS);
    return this.doors;
  }

  draw(context, camera, { timeS, theme }) {
    this.at(timeS);
    this.#shadows(context, camera, theme);
    this.#walls(context, camera, theme);
  }

  #shadows(context, camera, theme) {
    context.beginPath();
    for (const wall of this.walls) {
      const dx = SUN[0] * wall.heightM, dy = SUN[1] * wall.heightM;
      let corners = [[wall.x1, wall.y1], [wall.x2, wall.y2], [wall.x2 + dx, wall.y2 + dy],
        [wall.x1 + dx, wall.y1 + dy]];
      // All the same way round: where shadows overlap they do not cancel out.
      const turn = (wall.x2 - wall.x1) * dy - (wall.y2 - wall.y1) * dx;
      if (turn < 0) corners = corners.reverse();
      corners.forEach(([x, y], k) => {
        if (k === 0) context.moveTo(camera.sx(x), camera.sy(y));
        else context.lineTo(camera.sx(x), camera.sy(y));
      });
      context.closePath();
    }
    context.fillStyle = theme.shadow;
    context.fill();
  }

  #walls(context, camera, theme) {
    context.lineCap = "round";
    context.lineJoin = "round";
    for (const material of this.materials) {
      context.strokeStyle = theme.material(material);
      for (const heightM of new Set(this.walls.map((wall) => wall.heightM))) {
        context.lineWidth = Math.max(1.1, Math.min(0.16 + 0.04 * heightM, 0.4) * camera.scale);
        context.beginPath();
        for (const wall of this.walls) {
          if (wall.material !== material || wall.heightM !== heightM) continue;
          context.moveTo(camera.sx(wall.x1), camera.sy(wall.y1));
          context.lineTo(camera.sx(wall.x2), camera.sy(wall.y2));
        }
        context.stroke();
      }
    }
  }
}
