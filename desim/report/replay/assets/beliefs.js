// Pairs of hosts at an instant: whom frames reach, whom a host takes for online, who is apart.

const SEEN = ["never seen", "online", "offline", "removed"];

// Folds a table of changes of pairs up to an instant; forwards it goes on where it was.
class PairStates {
  constructor(table, hosts, first, second, state) {
    Object.assign(this, { table, hosts, first, second, state });
    this.rewind();
  }

  rewind() {
    this.values = new Uint8Array(this.hosts * this.hosts);
    this.changedS = new Float64Array(this.hosts * this.hosts).fill(-1e9);
    this.next = 0;
    this.timeS = -1;
  }

  at(timeS) {
    if (timeS < this.timeS) this.rewind();
    const { at, length } = this.table, limit = Math.round(timeS * NS);
    for (; this.next < length && at.ns[this.next] <= limit; this.next++) {
      const pair = at[this.first][this.next] * this.hosts + at[this.second][this.next];
      this.values[pair] = at[this.state][this.next];
      this.changedS[pair] = at.ns[this.next] / NS;
    }
    this.timeS = timeS;
    return this.values;
  }
}

class Beliefs {
  constructor(run) {
    this.run = run;
    this.hosts = run.hosts.length;
    this.links = new PairStates(run.link, this.hosts, "host", "other", "linked");
    this.views = new PairStates(run.sees, this.hosts, "believer", "other", "state");
  }

  get knowsLinks() { return this.run.link.length > 0; }
  get knowsViews() { return this.run.sees.length > 0; }

  // Whether frames get both ways.
  linked(one, other) {
    return this.links.values[one * this.hosts + other] && this.links.values[other * this.hosts + one];
  }

  // A part number for each robot: robots of one part are joined by chains of links.
  partsAt(timeS) {
    this.links.at(timeS);
    const robots = this.run.robots.length, part = new Int16Array(robots).fill(-1);
    let parts = 0;
    for (let start = 0; start < robots; start++) {
      if (part[start] >= 0 || !this.run.isUp(start, timeS)) continue;
      const agenda = [start];
      part[start] = parts;
      while (agenda.length) {
        const robot = agenda.pop(), host = this.run.hostOfRobot[robot];
        for (let other = 0; other < robots; other++) {
          if (part[other] < 0 && this.run.isUp(other, timeS)
              && this.linked(host, this.run.hostOfRobot[other])) {
            part[other] = parts;
            agenda.push(other);
          }
        }
      }
      parts += 1;
    }
    return { part, parts };
  }

  // 0 right, 1 taken for online and out of reach, 2 taken for gone and in reach.
  mistake(believer, other) {
    const seen = this.views.values[believer * this.hosts + other];
    if (!this.knowsLinks || seen === 0) return 0;
    const reached = this.linked(believer, other);
    if (seen === 1) return reached ? 0 : 1;
    return reached ? 2 : 0;
  }
}
