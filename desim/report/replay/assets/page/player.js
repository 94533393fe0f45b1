// The clock of the page: which instant is shown, and how fast it goes on.

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 20, 50, 100, 200];
const CATCH_UP_S = 1;  // of the viewer's time, in which a run that goes on is caught up with
const WHOLE_S = 60;  // about so long a run takes at the speed that the page begins with

class Player {
  constructor(runs) {
    this.runs = runs;
    this.startS = Math.min(...runs.map((run) => run.startS));
    this.timeS = this.startS;
    this.playing = false;
    const wanted = (this.endS - this.startS) / WHOLE_S;
    this.speed = SPEEDS.find((speed) => speed >= wanted) ?? SPEEDS.at(-1);
    if (wanted < 1) this.speed = 1;
  }

  get endS() {
    return Math.max(...this.runs.map((run) => run.endS));
  }

  seek(timeS) {
    this.timeS = Math.max(this.startS, Math.min(this.endS, timeS));
  }

  toggle() {
    if (!this.playing && this.timeS >= this.endS) this.timeS = this.startS;
    this.playing = !this.playing;
  }

  faster(steps) {
    const at = SPEEDS.indexOf(this.speed);
    this.speed = SPEEDS[Math.max(0, Math.min(SPEEDS.length - 1, at + steps))];
  }

  // Stay at the end of a run that goes on.
  follow() {
    this.following = true;
    this.playing = true;
  }

  // Nothing new will come: who follows is shown the rest.
  end() {
    this.ending = true;
  }

  // Follow no more: the viewer looks at another instant, or nothing new will come.
  leave() {
    if (this.following) this.playing = false;
    this.following = false;
  }

  // So many seconds of the viewer's time have passed.
  advance(wallS) {
    if (!this.playing) return;
    if (this.following) {
      this.seek(this.timeS + (this.endS - this.timeS) * Math.min(1, 2 * wallS / CATCH_UP_S));
      if (this.ending && this.endS - this.timeS < 0.05) {
        this.seek(this.endS);
        this.leave();
      }
      return;
    }
    this.seek(this.timeS + Math.min(wallS, 0.25) * this.speed);
    if (this.timeS >= this.endS) this.playing = false;
  }
}
