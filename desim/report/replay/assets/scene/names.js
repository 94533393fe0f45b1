// Robots' names where there is room, to the right or to the left: first the selected robot's.

const READABLE_SCALE = 12;  // pixels a metre: the names of a large fleet are shown from here on

class Names {
  constructor(run) {
    this.run = run;
  }

  draw(context, camera, view) {
    const { chosen, theme, ratio } = view;
    const all = !this.run.isLarge || camera.scale >= READABLE_SCALE;
    const style = { font: `500 10.5px ${theme.sans}`, lineHeight: 13, colour: theme.ink,
      halo: theme.halo, ratio };
    context.save();
    if (chosen >= 0) {
      const strong = { ...style, font: `600 12px ${theme.sans}`, lineHeight: 15 };
      this.#put(context, camera, view, chosen, view.labels.of(this.run.robots[chosen], strong));
      context.globalAlpha = 0.45;
    }
    for (let robot = 0; all && robot < this.run.robots.length; robot++) {
      if (robot === chosen) continue;
      this.#put(context, camera, view, robot,
        view.labels.of(shortName(this.run.robots[robot]), style));
    }
    context.restore();
  }

  #put(context, camera, view, robot, label) {
    const radius = robotRadius(this.run, camera, robot), away = radius + 3, { wide } = label;
    const sx = camera.sx(view.poses[3 * robot]), y = camera.sy(view.poses[3 * robot + 1]) - radius - 2;
    if (sx < -wide || y < -LINE_PX || sx > camera.width + wide || y > camera.height + LINE_PX) return;
    putWhereFree(context, view.taken, label, [sx + away, sx - away - wide], y);
  }
}
