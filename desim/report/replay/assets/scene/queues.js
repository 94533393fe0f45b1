// Messages that wait at their senders: their number, on a badge above each, off its body.

const BADGE_PX = { high: 12, many: 3 };  // of more than MANY_ROBOTS: a square without a number

class Queues {
  constructor(run, hosts, flights) {
    Object.assign(this, { run, hosts, flights });
  }

  draw(context, camera, view) {
    const { theme, ratio } = view;
    const style = { font: `600 9px ${theme.sans}`, lineHeight: 10, colour: theme.paper,
      halo: theme.alarm, ratio };
    context.save();
    context.fillStyle = theme.alarm;
    for (const [host, count] of [...this.flights.waiting].sort((a, b) => b[1] - a[1])) {
      const robot = this.run.robotOfHost[host];
      const away = robot < 0 ? 7 : robotRadius(this.run, camera, robot);
      const x = this.hosts.x(camera, host) - away, y = this.hosts.y(camera, host) - away;
      if (this.run.isLarge) {
        context.fillRect(x - BADGE_PX.many, y - BADGE_PX.many, BADGE_PX.many, BADGE_PX.many);
      } else queueBadge(context, view.labels.of(String(count), style), x, y, view.taken);
    }
    context.restore();
  }
}

// A number with its lower right corner at (x, y), where no other label is.
function queueBadge(context, label, x, y, taken = []) {
  const wide = label.wide + 6, left = x - wide, middle = y - BADGE_PX.high / 2;
  if (!isFree(taken, left, wide, middle)) return;
  taken.push({ from: left, until: x, y: middle });
  context.beginPath();
  context.roundRect(left, y - BADGE_PX.high, wide, BADGE_PX.high, 4);
  context.fill();
  putLabel(context, label, left + 3, middle);
}
