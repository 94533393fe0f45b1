// What the selected robot takes the others for: a mark beside each.

class Believed {
  constructor(run, hosts, beliefs) {
    Object.assign(this, { run, hosts, beliefs });
  }

  draw(context, camera, view) {
    const { beliefs } = this;
    if (view.chosen < 0 || !beliefs.knowsSees) return;
    const believer = this.run.hostOfRobot[view.chosen];
    beliefs.links.at(view.timeS);
    const states = beliefs.sees.at(view.timeS);
    context.save();
    for (let other = 0; other < beliefs.hosts; other++) {
      if (other === believer) continue;
      beliefMark(context, this.hosts.x(camera, other), this.hosts.y(camera, other) + 12,
        states[believer * beliefs.hosts + other], beliefs.mistake(believer, other), view.theme);
    }
    context.restore();
  }
}

// Online: a full dot; gone: an open one with a bar; never seen: a small ring. A mistake has a ring.
function beliefMark(context, x, y, state, mistake, theme) {
  context.globalAlpha = 1;
  context.lineWidth = 1.4;
  context.strokeStyle = context.fillStyle = state === 1 ? theme.accent : theme.soft;
  context.beginPath();
  circle(context, x, y, state === 0 ? 1.6 : 3);
  if (state === 1) context.fill(); else context.stroke();
  if (state >= 2) {
    context.beginPath();
    line(context, x - 4, y + 4, x + 4, y - 4);
    context.stroke();
  }
  if (mistake) {
    context.strokeStyle = theme.alarm;
    context.beginPath();
    circle(context, x, y, 6);
    context.stroke();
  }
}
