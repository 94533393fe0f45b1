// A line from each robot to its ghost, where they are apart.

const APART_M = 0.5;

class Tethers {
  constructor(scene, other) {
    Object.assign(this, { scene, other });
    const names = other.run.robots;
    this.pairs = scene.run.robots.map((name, robot) => [names.indexOf(name), robot])
      .filter(([there]) => there >= 0);
  }

  draw(context, camera, view) {
    const { poses } = this.other;  // as they were drawn in this frame
    context.save();
    context.lineWidth = 1;
    context.globalAlpha = 0.7;
    for (const [one, ghost] of this.pairs) {
      const [x1, y1] = [poses[3 * one], poses[3 * one + 1]];
      const [x2, y2] = [view.poses[3 * ghost], view.poses[3 * ghost + 1]];
      if (Math.hypot(x1 - x2, y1 - y2) < APART_M) continue;
      context.strokeStyle = robotColour(view.theme, one);
      context.beginPath();
      line(context, camera.sx(x1), camera.sy(y1), camera.sx(x2), camera.sy(y2));
      context.stroke();
    }
    context.restore();
  }
}
