// The time line: explored shares, traffic, partitions, events, and the instant that is shown.

const TOP_PX = 22, FOOT_PX = 15, SIDE_PX = 10;
const GLYPH_PX = 10;  // the width of an event's sign

class Timeline {
  constructor(canvas, app) {
    this.canvas = canvas;
    this.app = app;
    this.layer = new Layer();
    this.size = new Extent(canvas, () => app.changed());
    this.hoverS = null;
    this.#listen();
  }

  get #spanS() { return Math.max(1e-9, this.app.player.endS - this.app.player.startS); }

  x(timeS) {
    return SIDE_PX + (timeS - this.app.player.startS) / this.#spanS * (this.size.width - 2 * SIDE_PX);
  }

  timeAt(x) {
    return this.app.player.startS
      + (x - SIDE_PX) / (this.size.width - 2 * SIDE_PX) * this.#spanS;
  }

  #listen() {
    const at = (event) => this.timeAt(event.clientX - this.canvas.getBoundingClientRect().left);
    this.canvas.addEventListener("pointerdown", (event) => {
      this.canvas.setPointerCapture(event.pointerId);
      this.app.seek(at(event));
    });
    this.canvas.addEventListener("pointermove", (event) => {
      this.hoverS = at(event);
      if (event.buttons || event.pointerType === "touch") this.app.seek(at(event));
      this.app.changed();
    });
    this.canvas.addEventListener("pointerleave", () => { this.hoverS = null; this.app.changed(); });
  }

  draw(ratio) {
    const { app } = this, { width, height } = this.size.now();
    const version = app.runs.map((run) => run.version).join();
    const isNew = this.layer.kept(this.size, ratio,
      `${app.theme.name} ${version} ${app.difference?.timeS}`, (own) => this.#still(own));
    // As it is on the screen, to half a pixel.
    const shown = `${Math.round(2 * ratio * this.x(app.player.timeS))} ${this.hoverS}`;
    if (!isNew && shown === this.shown) return;
    this.shown = shown;
    const context = sized(this.canvas, width, height, ratio);
    context.clearRect(0, 0, this.size.width, this.size.height);
    this.layer.show(context, this.size);
    this.#moving(context);
  }

  #still(context) {
    const { app, size } = this, bottom = size.height - FOOT_PX;
    app.runs.forEach((run, which) => {
      for (const [beginS, endS] of run.partitions) {
        context.fillStyle = app.theme.split;
        context.fillRect(this.x(beginS), which ? (TOP_PX + bottom) / 2 : TOP_PX,
          Math.max(2, this.x(endS) - this.x(beginS)),
          (bottom - TOP_PX) / (app.runs.length > 1 ? 2 : 1));
      }
    });
    this.#traffic(context, app.runs[0], bottom);
    app.runs.forEach((run, which) => this.#explored(context, run, which, bottom));
    this.#axis(context, bottom);
    app.runs.forEach((run, which) => this.#events(context, run, which));
    if (app.difference) this.#difference(context, bottom);
    this.#key();
  }

  #traffic(context, run, bottom) {
    const rows = run.topic.at.bytes;
    if (!rows?.length) return;
    const total = sumRows(rows), most = Math.max(1, total.reduce((a, b) => Math.max(a, b), 0));
    const high = 0.55 * (bottom - TOP_PX);
    context.beginPath();
    context.moveTo(this.x(run.startS), bottom);
    for (let i = 0; i < total.length; i++) {
      const y = bottom - high * total[i] / most;
      context.lineTo(this.x(i), y);
      context.lineTo(this.x(Math.min(run.endS, i + 1)), y);
    }
    context.lineTo(this.x(run.endS), bottom);
    context.closePath();
    context.fillStyle = alpha(this.app.theme.soft, 0.2);
    context.fill();
  }

  // What the line and the area are, and where they end.
  #key() {
    const { runs } = this.app, rows = runs[0].topic.at.bytes;
    const most = rows?.length ? sumRows(rows).reduce((a, b) => Math.max(a, b)) : 0;
    document.querySelector("#curves").textContent = [
      runs.some(hasShares) ? "line: explored, 0 to 100 %" : "",
      most > 0 ? `grey: delivered, at most ${quantity(most, "B/s")}` : "",
    ].filter(Boolean).join("  ·  ");
  }

  // Of the first run the band between the least and the most informed robot, too.
  #explored(context, run, which, bottom) {
    const { us, union, explored } = run.second.at, count = run.second.length;
    if (!count) return;
    const { theme } = this.app, y = (share) => bottom - (bottom - TOP_PX - 2) * share / 1e4;
    if (which === 0 && explored.some(isRecorded)) {
      context.beginPath();
      const least = [];
      for (let i = 0; i < count; i++) {
        let low = Infinity, high = 0;
        for (const row of explored) {
          if (row[i] < 0) continue;
          low = Math.min(low, row[i]); high = Math.max(high, row[i]);
        }
        least.push([this.x(us[i] / 1e6), y(low === Infinity ? 0 : low)]);
        if (i === 0) context.moveTo(least[0][0], y(high));
        else context.lineTo(this.x(us[i] / 1e6), y(high));
      }
      for (const [px, py] of least.reverse()) context.lineTo(px, py);
      context.closePath();
      context.fillStyle = alpha(theme.accent, 0.16);
      context.fill();
    }
    if (!isRecorded(union)) return;
    context.beginPath();
    for (let i = 0; i < count; i++) {
      if (i === 0) context.moveTo(this.x(us[i] / 1e6), y(union[i]));
      else context.lineTo(this.x(us[i] / 1e6), y(union[i]));
    }
    context.strokeStyle = theme.accent;
    context.lineWidth = 1.6;
    context.setLineDash(which ? [5, 4] : []);
    context.stroke();
    context.setLineDash([]);
  }

  #axis(context, bottom) {
    const { theme, player } = this.app;
    context.strokeStyle = theme.rule;
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(SIDE_PX, bottom + 0.5);
    context.lineTo(this.size.width - SIDE_PX, bottom + 0.5);
    context.stroke();
    context.fillStyle = theme.soft;
    context.font = `10.5px ${this.app.theme.sans}`;
    context.textAlign = "center";
    context.textBaseline = "top";
    const step = niceStep(this.#spanS, Math.max(2, this.size.width / 110));
    for (let s = Math.ceil(player.startS / step) * step; s <= player.endS + 1e-9; s += step) {
      const x = this.x(s);
      context.fillRect(x - 0.5, bottom, 1, 3);
      if (x > 14 && x < this.size.width - 14) context.fillText(timeLabel(s, step), x, bottom + 4);
    }
  }

  // What is bad as a sign, all else as a tick.
  #events(context, run, which) {
    const { app } = this, { theme } = app;
    const y = app.runs.length > 1 ? [6, 16][which] : 10;
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.font = `600 12px ${this.app.theme.sans}`;
    context.fillStyle = alpha(theme.soft, 0.55);
    for (const event of run.events) {
      if (!BAD.has(event.kind)) context.fillRect(this.x(event.timeS) - 0.5, y - 3, 1, 6);
    }
    context.fillStyle = theme.alarm;
    context.strokeStyle = theme.paper;
    context.lineWidth = 2.5;
    const last = {};
    let taken = -GLYPH_PX;
    for (const event of run.events) {
      const place = this.x(event.timeS);
      if (!BAD.has(event.kind) || place - (last[event.kind] ?? -99) < 6) continue;
      // Beside the sign of another kind, if that is at its own place.
      const x = place - taken < GLYPH_PX && taken <= place ? taken + GLYPH_PX : place;
      last[event.kind] = place;
      taken = x;
      context.strokeText(EVENT_GLYPHS[event.kind], x, y);
      context.fillText(EVENT_GLYPHS[event.kind], x, y);
    }
  }

  #difference(context, bottom) {
    const { theme, difference } = this.app, x = this.x(difference.timeS);
    context.strokeStyle = context.fillStyle = theme.ink;
    context.setLineDash([2, 3]);
    context.lineWidth = 1;
    context.beginPath();
    context.moveTo(x, TOP_PX - 4); context.lineTo(x, bottom);
    context.stroke();
    context.setLineDash([]);
    context.font = `600 10.5px ${this.app.theme.sans}`;
    context.textAlign = x > this.size.width - 130 ? "right" : "left";
    context.textBaseline = "top";
    context.strokeStyle = theme.paper;
    context.lineWidth = 3;
    const place = x + (context.textAlign === "left" ? 5 : -5);
    context.strokeText("first difference", place, TOP_PX + 4);
    context.fillText("first difference", place, TOP_PX + 4);
  }

  #moving(context) {
    const { theme, player } = this.app, x = this.x(player.timeS);
    const bottom = this.size.height - FOOT_PX;
    context.fillStyle = alpha(theme.paper, 0.55);
    context.fillRect(x, 0, this.size.width - x, bottom);
    context.fillStyle = theme.ink;
    context.fillRect(x - 0.75, 2, 1.5, bottom - 2);
    context.beginPath();
    context.arc(x, bottom, 4.5, 0, 2 * Math.PI);
    context.fill();
    if (this.hoverS !== null && this.hoverS >= player.startS && this.hoverS <= player.endS) {
      const hx = this.x(this.hoverS);
      context.fillStyle = alpha(theme.ink, 0.35);
      context.fillRect(hx - 0.5, TOP_PX, 1, bottom - TOP_PX);
      context.fillStyle = theme.ink;
      context.font = `600 10.5px ${this.app.theme.sans}`;
      context.textAlign = hx > this.size.width - 60 ? "right" : "left";
      context.textBaseline = "bottom";
      context.fillText(clock(this.hoverS), hx + (context.textAlign === "left" ? 4 : -4), bottom - 2);
    }
  }
}

// A round step so that a span has about so many of them.
function niceStep(span, wanted) {
  const rough = span / Math.max(1, wanted);
  return [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600]
    .find((step) => step >= rough) ?? 7200;
}

function timeLabel(s, step) {
  if (s < 60 || step < 1) return `${+s.toFixed(1)} s`;
  const minutes = Math.floor(s / 60), rest = Math.round(s - 60 * minutes);
  return rest ? `${minutes}:${String(rest).padStart(2, "0")}` : `${minutes} min`;
}
