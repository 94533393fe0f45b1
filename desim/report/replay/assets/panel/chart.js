// A small chart in step with the scene: all of it faint, the part that has been shown strong.

const MOST_LINES = 8;  // whose values are written below

class Chart {
  constructor(chart, changed) {
    this.chart = chart;
    this.element = document.createElement("figure");
    this.element.className = "chart";
    this.element.innerHTML = "<figcaption><b></b><small></small><span></span></figcaption><canvas></canvas>";
    this.element.querySelector("b").textContent = chart.title;
    this.canvas = this.element.querySelector("canvas");
    this.layer = new Layer();
    this.extent = new Extent(this.canvas, changed);
    this.values = chart.lines.slice(0, MOST_LINES).map((line) => {
      const item = document.createElement("i");
      item.style.setProperty("--key", line.colour);
      return item;
    });
    this.element.querySelector("span").append(...this.values);
    const values = chart.lines.flatMap((line) => line.values.filter((v) => v > 0));
    this.most = chart.max ?? values.reduce((a, b) => Math.max(a, b), 1e-9);
    this.least = chart.log ? Math.min(values.reduce((a, b) => Math.min(a, b), Infinity),
      this.most / 10) : 0;
    this.element.querySelector("small").textContent = values.length
      ? `${chart.log ? quantity(this.least, chart.unit) : "0"} to ${quantity(this.most, chart.unit)}`
        + (chart.log ? ", logarithmic" : "") : "";
  }

  y(value, high) {
    const share = this.chart.log
      ? Math.log(Math.max(value, this.least) / this.least) / Math.log(this.most / this.least)
      : value / this.most;
    return high - 2 - (high - 6) * Math.max(0, Math.min(1, share));
  }

  draw(app, ratio) {
    const size = this.extent.now(), { player, theme } = app;
    if (!size.width) return;
    const x = (timeS) => (timeS - player.startS) / Math.max(1e-9, player.endS - player.startS)
      * size.width;
    this.layer.kept(size, ratio, theme.name, (own) => this.#lines(own, x, size.height));
    const context = sized(this.canvas, size.width, size.height, ratio);
    context.clearRect(0, 0, size.width, size.height);
    this.layer.show(context, size);
    const now = x(player.timeS);
    context.fillStyle = alpha(theme.paper, 0.62);
    context.fillRect(now, 0, size.width - now, size.height);
    context.fillStyle = theme.ink;
    context.fillRect(now - 0.5, 0, 1, size.height);
    this.#caption(player.timeS);
  }

  #lines(context, x, high) {
    context.lineJoin = "round";
    for (const line of [...this.chart.lines].reverse()) {
      context.strokeStyle = context.fillStyle = line.colour;
      context.lineWidth = 1.4;
      context.setLineDash(line.dashed ? [4, 3] : []);
      context.beginPath();
      if (this.chart.dots) {
        line.times.forEach((timeS, i) => {
          if (line.values[i] > 0) context.rect(x(timeS) - 0.9, this.y(line.values[i], high) - 0.9, 1.8, 1.8);
        });
        context.fill();
        continue;
      }
      line.times.forEach((timeS, i) => {
        const py = this.y(line.values[i], high);
        if (i === 0) context.moveTo(x(timeS), py); else context.lineTo(x(timeS), py);
        if (line.steps && i + 1 < line.times.length) context.lineTo(x(line.times[i + 1]), py);
      });
      context.stroke();
    }
  }

  #caption(timeS) {
    this.values.forEach((item, k) => {
      const line = this.chart.lines[k], at = countUpTo(line.times, timeS) - 1;
      const value = line.now?.(timeS) ?? (at < 0 ? 0 : line.values[at]);
      const text = `${line.name} ${quantity(Math.max(0, value), this.chart.unit)}`;
      if (item.textContent !== text) item.textContent = text;
    });
  }
}
