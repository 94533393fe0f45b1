// Loads of links: the more bytes a second, the wider and the denser; the colour is the kind of traffic.

const LEVELS = 12, TOGETHER = 300;
const BELOW_FAMILY = 0.35;  // loads are of all topics: so pale below the messages of some

class Loads {
  constructor(run, hosts, traffic) {
    Object.assign(this, { run, hosts, traffic });
    this.counted = { key: "" };
  }

  key(view) {
    return `${view.moves} ${this.traffic.bin(view.timeS)} ${view.selected}`;
  }

  // Links of about the same load are one path.
  draw(context, camera, view) {
    const { count, levels } = this.#levels(view);
    const thinner = isNarrow(this.run, view.selection) ? 1
      : Math.min(1, Math.sqrt(16 / Math.max(1, count)));
    const pale = view.selection.kind === "family" ? BELOW_FAMILY : 1;
    context.save();
    context.lineCap = "round";
    for (const [level, pairs] of levels) {
      const share = Math.floor(level / KINDS.length) / LEVELS;
      context.strokeStyle = view.theme.kinds[level % KINDS.length];
      context.globalAlpha = (0.15 + 0.5 * share) * thinner * pale;
      context.lineWidth = 0.5 + 4 * share * share * (0.4 + 0.6 * thinner);
      // Where lines of one path cross, they do not add up: few lines are drawn one by one.
      const together = pairs.length > 2 * TOGETHER;
      if (together) context.beginPath();
      for (let i = 0; i < pairs.length; i += 2) {
        if (!together) context.beginPath();
        context.moveTo(this.hosts.x(camera, pairs[i]), this.hosts.y(camera, pairs[i]));
        context.lineTo(this.hosts.x(camera, pairs[i + 1]), this.hosts.y(camera, pairs[i + 1]));
        if (!together) context.stroke();
      }
      if (together) context.stroke();
    }
    context.restore();
  }

  // The pairs of hosts of each level and kind, as long as the loads are the same.
  #levels(view) {
    const key = `${this.traffic.bin(view.timeS)} ${view.selected}`;
    if (key === this.counted.key) return this.counted;
    const loads = new Map(), hosts = this.run.hosts.length, levels = new Map();
    this.traffic.loads(view.timeS, (source, destination, kind, rate) => {
      if (!isLit(this.run, view.selection, source, destination)) return;
      const pair = Math.min(source, destination) * hosts + Math.max(source, destination);
      const known = loads.get(pair);
      if (!known) { loads.set(pair, { rate, kind, most: rate }); return; }
      known.rate += rate;
      if (rate > known.most) { known.kind = kind; known.most = rate; }
    });
    for (const [pair, { rate, kind }] of loads) {
      const level = Math.round(LEVELS * loadShare(rate)) * KINDS.length + kind;
      if (!levels.has(level)) levels.set(level, []);
      levels.get(level).push(Math.floor(pair / hosts), pair % hosts);
    }
    return this.counted = { key, count: loads.size, levels };
  }
}

// How wide a link's load is drawn, 0 to 1: from 10 B/s to 10 MB/s, by its logarithm.
function loadShare(rate) {
  return Math.max(0, Math.min(1, (Math.log10(rate + 1) - 1) / 6));
}
