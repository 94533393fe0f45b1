// Links that are there, thin; those that appeared or broke a moment ago, flashing.

const FLASH_S = 1.5;  // of simulated time

class Links {
  constructor(run, hosts, beliefs) {
    Object.assign(this, { run, hosts, beliefs });
  }

  key(view) {
    this.beliefs.links.at(view.timeS);
    return [view.moves, this.beliefs.links.next, view.up.changes, view.selected].join();
  }

  draw(context, camera, view) {
    const pair = pairOf(this.run, view.selection);
    if (pair) this.#chosen(context, camera, view, ...pair);
    if (!this.#areDrawn(view)) return;
    this.beliefs.links.at(view.timeS);
    context.save();
    context.strokeStyle = view.theme.soft;
    context.lineWidth = 0.8;
    context.globalAlpha = isNarrow(this.run, view.selection) ? 0.4
      : Math.min(0.22, 2.2 / Math.max(6, this.beliefs.hosts));
    context.beginPath();
    this.#pairs(view, (one, other) => {
      if (this.beliefs.linked(one, other)) line(context, ...this.hosts.ends(camera, one, other));
    });
    context.stroke();
    context.restore();
  }

  #areDrawn(view) {
    return this.beliefs.knowsLinks && (!this.run.isLarge || isNarrow(this.run, view.selection));
  }

  // Calls visit(one, other) for each pair of hosts that may be drawn.
  #pairs(view, visit) {
    const { robotOfHost } = this.run, { hosts } = this.beliefs, { robots: up } = view.up;
    const runs = (host) => robotOfHost[host] < 0 || up[robotOfHost[host]];
    for (let one = 0; one < hosts; one++) {
      if (!runs(one)) continue;
      for (let other = one + 1; other < hosts; other++) {
        if (runs(other) && isLit(this.run, view.selection, one, other)) visit(one, other);
      }
    }
  }

  // What has changed a moment ago.
  flash(context, camera, view) {
    const { links, hosts } = this.beliefs, fresh = [];
    links.at(view.timeS);
    if (!this.#areDrawn(view) || view.timeS - links.lastS >= FLASH_S) return;
    this.#pairs(view, (one, other) => {
      const changedS = Math.max(links.changedS[one * hosts + other], links.changedS[other * hosts + one]);
      const share = 1 - (view.timeS - changedS) / FLASH_S;
      if (share > 0 && changedS > this.run.startS + 0.01) fresh.push([one, other, share]);
    });
    const dense = Math.min(1, 24 / Math.max(1, fresh.length));
    context.save();
    context.lineWidth = 1.4;
    for (const [one, other, share] of fresh) {
      const there = this.beliefs.linked(one, other);
      context.globalAlpha = share * (0.25 + 0.5 * dense);
      context.strokeStyle = there ? view.theme.accent : view.theme.alarm;
      context.setLineDash(there ? [] : [4, 5]);
      context.beginPath();
      line(context, ...this.hosts.ends(camera, one, other));
      context.stroke();
    }
    context.restore();
  }

  #chosen(context, camera, view, one, other) {
    context.save();
    context.globalAlpha = 0.3;
    context.lineCap = "round";
    context.strokeStyle = view.theme.accent;
    context.lineWidth = 10;
    context.beginPath();
    line(context, ...this.hosts.ends(camera, one, other));
    context.stroke();
    context.restore();
  }
}

// The flashes as a drawing of their own: they change in each frame, the links do not.
class Flashes {
  constructor(links) {
    this.links = links;
  }

  draw(context, camera, view) {
    this.links.flash(context, camera, view);
  }
}
