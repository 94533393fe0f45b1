// Pairs at an instant: whom frames reach, whom a host takes for online, who hangs on whom.

// Folds a table of changes of pairs up to an instant; forwards it goes on where it was.
class PairStates {
  // The first of a pair is one of the run's hosts, the second one of `others`.
  constructor(table, run, first, second, state, others = run.hosts) {
    Object.assign(this, { table, first, second, state, others: others.length,
      pairs: run.hosts.length * others.length });
    this.rewind();
  }

  rewind() {
    this.values = new Uint8Array(this.pairs);
    this.changedS = new Float64Array(this.pairs).fill(-1e9);
    this.next = 0;
    this.lastS = -Infinity;  // of the last change so far
    this.timeS = -1;
  }

  at(timeS) {
    if (timeS < this.timeS) this.rewind();
    const { at, length } = this.table, limit = Math.round(timeS * NS);
    for (; this.next < length && at.ns[this.next] <= limit; this.next++) {
      const pair = at[this.first][this.next] * this.others + at[this.second][this.next];
      this.values[pair] = at[this.state][this.next];
      this.changedS[pair] = this.lastS = at.ns[this.next] / NS;
    }
    this.timeS = timeS;
    return this.values;
  }
}

class Beliefs {
  constructor(run) {
    this.run = run;
    this.hosts = run.hosts.length;
    this.links = new PairStates(run.link, run, "host", "other", "linked");
    this.sees = new PairStates(run.sees, run, "believer", "other", "state");
  }

  get knowsLinks() { return this.run.link.length > 0; }
  get knowsSees() { return this.run.sees.length > 0; }

  // Whether frames get both ways.
  linked(one, other) {
    return this.links.values[one * this.hosts + other] && this.links.values[other * this.hosts + one];
  }

  // The number of parts of the fleet: robots of one part are joined by chains of links.
  partsAt(timeS) {
    this.links.at(timeS);
    const up = this.run.upAt(timeS), key = `${this.links.next} ${up.changes}`;
    if (this.parts?.key !== key) this.parts = { key, count: this.#count(up.robots) };
    return this.parts.count;
  }

  #count(up) {
    const left = new Set(this.run.robots.keys());
    let parts = 0;
    for (const start of left) {
      left.delete(start);
      if (!up[start]) continue;
      const agenda = [start];
      while (agenda.length) {
        const host = this.run.hostOfRobot[agenda.pop()];
        for (const other of left) {
          if (up[other] && this.linked(host, this.run.hostOfRobot[other])) {
            left.delete(other);
            agenda.push(other);
          }
        }
      }
      parts += 1;
    }
    return parts;
  }

  // 0 right, 1 taken for online and out of reach, 2 taken for gone and in reach.
  mistake(believer, other) {
    const seen = this.sees.values[believer * this.hosts + other];
    if (!this.knowsLinks || seen === 0) return 0;
    const reached = this.linked(believer, other);
    if (seen === 1) return reached ? 0 : 1;
    return reached ? 2 : 0;
  }
}
