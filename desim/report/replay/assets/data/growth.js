// The growth of the maps: who discovered each cell, and when; each robot's own map.

const NEVER = 65535;

class Growth {
  constructor(run) {
    const { about, columns } = run.growth;
    this.run = run;
    this.about = about;
    this.columns = columns;
    this.first = columns.values("merged.robot");
    this.merged = this.#map("merged");
    this.lives = new Map();
  }

  // The cells of a map in the order in which they became known.
  #map(name) {
    const is = this.columns.values(`${name}.known.is`);
    const held = this.columns.values(`${name}.known`);
    const known = new Uint16Array(held.length);
    let last = 0;
    for (let i = 0; i < held.length; i++) {
      known[i] = is[i] ? held[i] : NEVER;
      if (is[i] && held[i] > last) last = held[i];
    }
    const starts = new Int32Array(last + 3);
    for (let i = 0; i < known.length; i++) if (is[i]) starts[known[i] + 1] += 1;
    for (let ds = 1; ds < starts.length; ds++) starts[ds] += starts[ds - 1];
    const order = new Int32Array(starts[last + 1]), at = starts.slice();
    for (let i = 0; i < known.length; i++) if (is[i]) order[at[known[i]]++] = i;
    return { known, order, starts, last, occupied: this.columns.values(`${name}.occupied`) };
  }

  // The map of the robot's life that runs at the time, and when the life began; null: none.
  ofRobot(robot, timeS) {
    const { lives } = this.run;
    for (let k = lives.length - 1; k >= 0; k--) {
      const [whose, fromNs] = lives[k];
      if (whose !== robot || fromNs > timeS * NS + 1) continue;
      if (!this.columns.has(`growth.${k}.known`)) continue;  // it has begun since the last maps
      if (!this.lives.has(k)) this.lives.set(k, this.#map(`growth.${k}`));
      return { map: this.lives.get(k), fromS: fromNs / NS, key: k };
    }
    return null;
  }
}

// The number of cells that a map has by a tenth of a second.
function cellsBy(map, ds) {
  if (ds < 0) return 0;
  return map.starts[Math.min(ds, map.last) + 1];
}

// The share explored by all together, in hundredths of a percent; null: not recorded. Between two
// samples it grows as the cells do that are drawn. The first sample is of the instant before the
// first scans.
function exploredAt({ run, growth }, timeS) {
  const { us, union } = run.second.at, count = run.second.length;
  if (!count) return null;
  const at = Math.max(0, countUpTo(us, timeS * 1e6) - 1), share = union[at];
  if (share < 0) return null;
  if (!growth || at + 1 >= count || union[at + 1] <= share) return share;
  const cells = (s) => cellsBy(growth.merged, Math.floor(10 * s + 1e-6));
  const before = share ? cells(us[at] / 1e6) : 0, after = cells(us[at + 1] / 1e6);
  const grown = (cells(timeS) - before) / Math.max(1, after - before);
  return share + (union[at + 1] - share) * Math.max(0, Math.min(1, grown));
}
