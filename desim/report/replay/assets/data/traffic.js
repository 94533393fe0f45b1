// What is on the network at an instant: messages under way, load per link.

const LATE_S = 1;
const LONG_S = 3;  // messages that take longer are looked up one by one

class Traffic {
  constructor(run) {
    this.run = run;
    this.refresh();
  }

  // Index what the run has; again after more was appended.
  refresh() {
    const { message, about } = this.run, at = message.at;
    this.long = [];
    for (let k = 0; k < message.length; k++) if (at.flight_us[k] > LONG_S * 1e6) this.long.push(k);
    this.loadS = about.load_s;
  }

  // Calls visit(k, share of the way, seconds since its end) for each message to be seen at the time.
  // One that is under way for less than `leastS` is shown for so long, a lost one `afterS` longer.
  inFlight(timeS, leastS, afterS, visit) {
    const { born_us: born, flight_us: flight, left_us: left, reason } = this.run.message.at;
    const us = timeS * 1e6, window = (LONG_S + leastS + afterS) * 1e6;
    const one = (k) => {
      const start = left[k] > 0 ? born[k] + left[k] : born[k];
      const end = Math.max(born[k] + flight[k], start + leastS * 1e6);
      if (us < born[k] || us > end + (reason[k] ? afterS * 1e6 : 0)) return;
      const share = left[k] < 0 ? 0 : Math.max(0, Math.min(1, (us - start) / (end - start)));
      visit(k, share, Math.max(0, (us - end) / 1e6));
    };
    const from = countUpTo(born, us - window, this.run.message.length);
    const until = countUpTo(born, us, this.run.message.length);
    for (let k = from; k < until; k++) one(k);
    for (const k of this.long) {
      if (born[k] > us) break;
      if (k < from) one(k);
    }
  }

  // The number of the step of loads at the time.
  bin(timeS) {
    return Math.floor(timeS / this.loadS);
  }

  // Calls visit(source, destination, kind, bytes a second) for each loaded link at the time.
  loads(timeS, visit) {
    const { bin, source, destination, kind, bytes } = this.run.load.at;
    const now = this.bin(timeS);
    let k = countUpTo(bin, now - 1, this.run.load.length);
    for (; k < this.run.load.length && bin[k] === now; k++) {
      visit(source[k], destination[k], kind[k], bytes[k] / this.loadS);
    }
  }

  // Bytes a second of one pair of hosts over time: there and back.
  pairSeries(one, other) {
    const { bin, source, destination, bytes } = this.run.load.at;
    const count = Math.floor(this.run.endS / this.loadS) + 1;
    const there = new Float64Array(count), back = new Float64Array(count);
    for (let k = 0; k < this.run.load.length; k++) {
      if (source[k] === one && destination[k] === other) there[bin[k]] += bytes[k] / this.loadS;
      else if (source[k] === other && destination[k] === one) back[bin[k]] += bytes[k] / this.loadS;
    }
    return { there, back, stepS: this.loadS };
  }

  // The latencies in s of the drawn messages that `wanted(k)` picks, at their ends.
  latencies(wanted) {
    const { born_us: born, flight_us: flight, reason } = this.run.message.at, out = [];
    for (let k = 0; k < this.run.message.length; k++) {
      if (!reason[k] && wanted(k)) {
        out.push({ timeS: (born[k] + flight[k]) / 1e6, value: flight[k] / 1e6 });
      }
    }
    return out.sort((a, b) => a.timeS - b.timeS);
  }

  // Whether a message has been born and none of its frames has left.
  waits(k, timeS) {
    const { born_us: born, flight_us: flight, left_us: left } = this.run.message.at;
    const us = timeS * 1e6;
    return us >= born[k] && us < born[k] + (left[k] < 0 ? flight[k] : left[k]);
  }

  isLate(k) {
    return this.run.message.at.flight_us[k] >= LATE_S * 1e6;
  }
}
