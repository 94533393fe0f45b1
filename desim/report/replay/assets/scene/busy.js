// Robots whose processors are busy: a bar below each, as long as their share, from 90 % on (as many as
// "saturates" means in the summary of a run).

const BUSY = 0.9;
const BUSY_BAR = { wide: 18, high: 3.5 };

class BusyProcessors {
  constructor(run) {
    this.run = run;
  }

  draw(context, camera, view) {
    const { run } = this, second = countUpTo(run.second.at.us, view.timeS * 1e6) - 1;
    context.save();
    for (let robot = 0; robot < run.robots.length; robot++) {
      const share = run.busyShare(robot, second);
      if (share < BUSY || !view.up.robots[robot]) continue;
      busyBar(context, camera.sx(view.poses[3 * robot]), camera.sy(view.poses[3 * robot + 1])
        + robotRadius(run, camera, robot) + 5, share, view.theme);
    }
    context.restore();
  }
}

function busyBar(context, x, y, share, theme) {
  const { wide, high } = BUSY_BAR;
  context.fillStyle = theme.halo;
  context.fillRect(x - wide / 2 - 1, y - 1, wide + 2, high + 2);
  context.fillStyle = theme.alarm;
  context.fillRect(x - wide / 2, y, wide * share, high);
}
