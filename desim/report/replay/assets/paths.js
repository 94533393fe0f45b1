// The ways that robots have driven: all of each one thin, the last seconds strong.

const RECENT_S = 12;
const LEAST_PX = 1.2;  // nearer points add nothing to a line

class Paths {
  constructor(run) {
    this.run = run;
    this.layer = new Layer();
    this.drawn = -1;
    this.pen = null;  // pixels where each robot's line has got to
  }

  draw(context, camera, view) {
    const [at] = this.run.poseIndex(view.timeS), dashed = view.ghost;
    if (at < this.drawn) this.layer.key = null;
    this.layer.kept(camera, view.ratio, `${view.theme.name}${dashed}`, () => { this.drawn = -1; });
    if (this.drawn < at) this.#extend(at, camera, view, dashed);
    context.save();
    context.globalAlpha = view.selection.kind === "robot" ? 0.25 : 0.55;
    this.layer.show(context, camera);
    context.restore();
    this.#recent(context, camera, view, at);
  }

  // Continue the kept drawing up to a sample.
  #extend(at, camera, view, dashed) {
    const context = this.layer.canvas.getContext("2d"), { x_mm: xs, y_mm: ys } = this.run.pose.at;
    const from = Math.max(0, this.drawn);
    if (this.drawn < 0) this.pen = this.run.robots.map(() => null);
    context.lineWidth = 1;
    context.lineJoin = "round";
    context.setLineDash(dashed ? [3, 3] : []);
    for (let robot = 0; robot < this.run.robots.length; robot++) {
      context.strokeStyle = alpha(robotColour(view.theme, robot), 0.6);
      context.beginPath();
      let [px, py] = this.pen[robot]
        ?? [camera.sx(xs[robot][from] / 1000), camera.sy(ys[robot][from] / 1000)];
      context.moveTo(px, py);
      for (let i = from; i <= at; i++) {
        const x = camera.sx(xs[robot][i] / 1000), y = camera.sy(ys[robot][i] / 1000);
        if (Math.abs(x - px) + Math.abs(y - py) < LEAST_PX) continue;
        context.lineTo(x, y);
        px = x; py = y;
      }
      context.stroke();
      this.pen[robot] = [px, py];
    }
    this.drawn = at;
  }

  #recent(context, camera, view, at) {
    const chosen = view.selection.kind === "robot" ? view.selection.robot : -1;
    context.save();
    context.lineCap = "round";
    context.lineJoin = "round";
    context.lineWidth = 1.7;
    if (this.run.robots.length > MANY_ROBOTS) {
      this.#crowd(context, camera, view, at, chosen >= 0 ? 0.35 : view.theme.trail);
      if (chosen >= 0) this.#fading(context, camera, view, at, chosen, chosen);
    } else {
      this.run.robots.forEach((_, robot) => this.#fading(context, camera, view, at, robot, chosen));
    }
    context.restore();
  }

  #since(timeS) {
    return Math.max(0, countUpTo(this.run.pose.at.ns, (timeS - RECENT_S) * NS, this.run.pose.length) - 1);
  }

  // The last seconds of many robots: those of one colour at once.
  #crowd(context, camera, view, at, opacity) {
    const { x_mm: xs, y_mm: ys } = this.run.pose.at, from = this.#since(view.timeS);
    const hues = ROBOT_HUES[view.theme.name].length, count = this.run.robots.length;
    context.globalAlpha = opacity * (view.ghost ? 0.6 : 1);
    for (let hue = 0; hue < hues; hue++) {
      context.strokeStyle = robotColour(view.theme, hue);
      context.beginPath();
      for (let robot = hue; robot < count; robot += hues) {
        this.#line(context, camera, xs[robot], ys[robot], from, at);
      }
      context.stroke();
    }
  }

  // The last seconds of one robot, fading; all of the selected one.
  #fading(context, camera, view, at, robot, chosen) {
    const { x_mm: xs, y_mm: ys } = this.run.pose.at, strong = robot === chosen;
    const from = strong ? 0 : this.#since(view.timeS), parts = strong ? 1 : 3;
    context.strokeStyle = robotColour(view.theme, robot);
    for (let part = 0; part < parts; part++) {
      const begin = from + Math.floor((at - from) * part / parts);
      const end = from + Math.floor((at - from) * (part + 1) / parts);
      if (end <= begin && part < parts - 1) continue;
      context.globalAlpha = (strong ? 0.9 : (chosen >= 0 ? 0.35 : view.theme.trail))
        * (part + 1) / parts * (view.ghost ? 0.6 : 1);
      context.beginPath();
      this.#line(context, camera, xs[robot], ys[robot], begin, end);
      if (part === parts - 1) {
        context.lineTo(camera.sx(view.poses[3 * robot]), camera.sy(view.poses[3 * robot + 1]));
      }
      context.stroke();
    }
  }

  #line(context, camera, x, y, begin, end) {
    let px = camera.sx(x[begin] / 1000), py = camera.sy(y[begin] / 1000);
    context.moveTo(px, py);
    for (let i = begin + 1; i <= end; i++) {
      const sx = camera.sx(x[i] / 1000), sy = camera.sy(y[i] / 1000);
      if (i < end && Math.abs(sx - px) + Math.abs(sy - py) < LEAST_PX) continue;
      context.lineTo(sx, sy);
      px = sx; py = sy;
    }
  }
}
