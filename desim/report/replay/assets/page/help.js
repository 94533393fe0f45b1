// The help: the keys, and a key of the symbols and colours, drawn as the scene draws them.

const SYMBOL_WIDTH = 64, SYMBOL_HEIGHT = 28;

// What it is, and what draws it around (x, y) in the middle. The colours are those of two robots.
const SYMBOLS = [
  ["robot; its nose is its heading, the number its name", (context, theme, x, y, labels) => {
    symbolRobot(context, theme, x - 8, y + 3);
    putLabel(context, labels("7"), x + 5, y - 5);
  }],
  ["selected robot", (context, theme, x, y) => symbolRobot(context, theme, x, y, { chosen: true })],
  ["its host is down", (context, theme, x, y) => symbolRobot(context, theme, x, y, { up: false })],
  ["ghost: the same robot in run B", (context, theme, x, y) => {
    context.strokeStyle = theme.hues[0];
    context.beginPath();
    line(context, x - 16, y + 4, x + 14, y - 3);
    context.stroke();
    symbolRobot(context, theme, x - 16, y + 4);
    symbolRobot(context, theme, x + 14, y - 3, { hollow: true });
  }],
  ["laser fan of the selected robot; of many they are one light area", (context, theme, x, y) => {
    context.beginPath();
    context.moveTo(x - 22, y);
    context.arc(x - 22, y, 44, -0.3, 0.3);
    context.closePath();
    fillFan(context, theme.hues[0], theme, true);
  }],
  ["sonar: the nearest wall in each cone", (context, theme, x, y) => {
    [[0.3, 40], [-0.3, 30]].forEach(([angle, range]) => sonarCone(context, x - 20, y, angle, 0.5, range,
      alpha(theme.hues[0], 0.16), theme.hues[0]));
  }],
  ["bumper that has just been pressed", (context, theme, x, y) => {
    bumperRing(context, x, y, 6, theme);
    symbolRobot(context, theme, x, y);
  }],
  ["its processors are busy for 90 % or more", (context, theme, x, y) => {
    symbolRobot(context, theme, x, y - 4);
    busyBar(context, x, y + 6, 0.95, theme);
  }],
  ["explored map: the discoverer's colour, bright for 4 s", (context, theme, x, y) => {
    [[0, theme.tint], [2, theme.tint], [0, theme.glow]].forEach(([hue, share], k) => {
      context.fillStyle = `rgb(${mixed(theme.free, rgb(theme.hues[hue]), share)})`;
      context.fillRect(x - 27 + 18 * k, y - 9, 18, 18);
    });
  }],
  ["path; the last 12 s strong", (context, theme, x, y) => {
    context.strokeStyle = theme.hues[0];
    context.globalAlpha = 0.35;
    context.beginPath();
    line(context, x - 26, y + 4, x, y);
    context.stroke();
    context.globalAlpha = 1;
    context.lineWidth = 1.7;
    context.beginPath();
    line(context, x, y, x + 26, y - 4);
    context.stroke();
  }],
  ["plan, and the goal at its end", (context, theme, x, y) => {
    context.strokeStyle = context.fillStyle = theme.hues[0];
    context.beginPath();
    line(context, x - 26, y + 4, x + 14, y);
    strokePlan(context, true);
    goalMark(context, x + 20, y, true);
  }],
  ["frontiers of the selected robot", (context, theme, x, y) => {
    context.strokeStyle = theme.hues[0];
    for (const [dx, dy] of [[-14, 3], [-2, -4], [11, 2]]) frontierMark(context, x + dx, y + dy);
  }],
  ["what a strategy shows: a utility, a bid, a meeting", (context, theme, x, y, labels) => {
    context.fillStyle = theme.hues[0];
    context.beginPath();
    circle(context, x - 20, y, 2);
    context.fill();
    putLabel(context, labels("12 m"), x - 14, y);
  }],
  ["where SLAM takes the robot to be", (context, theme, x, y) => {
    symbolRobot(context, theme, x - 8, y);
    context.strokeStyle = theme.hues[0];
    believedRing(context, x - 8, y, x + 10, y - 4, 6);
  }],
  ["link: frames get from one to the other", (context, theme, x, y) => symbolLine(context, x, y, {
    strokeStyle: theme.soft, lineWidth: 1, globalAlpha: 0.6 })],
  ["link that has just broken (dashed) or come", (context, theme, x, y) => {
    context.setLineDash([4, 5]);
    symbolLine(context, x, y - 4, { strokeStyle: theme.alarm, lineWidth: 1.4 });
    context.setLineDash([]);
    symbolLine(context, x, y + 5, { strokeStyle: theme.accent, lineWidth: 1.4 });
  }],
  ["access point, its channel, and a robot that hangs on it", (context, theme, x, y) => {
    Object.assign(context, { strokeStyle: theme.hues[0], lineWidth: 1.6 });
    associationLine(context, x - 14, y, x + 20, y);
    symbolRobot(context, theme, x + 20, y);
    accessPointMark(context, x - 14, y, theme);
  }],
  ["it hangs on no access point", (context, theme, x, y) => {
    symbolRobot(context, theme, x - 4, y - 3);
    noAccessPointMark(context, x + 8, y + 6, theme);
  }],
  ...KINDS.map((kind, k) => [`load: ${kind}; the wider, the more`, (context, theme, x, y) => {
    context.lineCap = "round";
    symbolLine(context, x, y - 5, { strokeStyle: theme.kinds[k], lineWidth: 0.8, globalAlpha: 0.5 });
    symbolLine(context, x, y + 4, { strokeStyle: theme.kinds[k], lineWidth: 3.6, globalAlpha: 0.65 });
  }]),
  ["message, in its sender's colour", (context, theme, x, y) => {
    symbolLine(context, x, y, { strokeStyle: theme.soft, lineWidth: 0.8, globalAlpha: 0.4 });
    symbolDot(context, theme, x, y);
  }],
  ["message under way for 1 s or longer", (context, theme, x, y) => {
    symbolDot(context, theme, x, y);
    context.strokeStyle = theme.alarm;
    context.lineWidth = 1.1;
    context.beginPath();
    circle(context, x, y, 4.6);
    context.stroke();
  }],
  ["message that was lost", (context, theme, x, y) => {
    context.strokeStyle = theme.alarm;
    context.lineWidth = 1.6;
    context.beginPath();
    drop(context, x, y, 3.2);
    context.stroke();
  }],
  ["messages that wait at their sender", (context, theme, x, y, labels) => {
    symbolRobot(context, theme, x + 4, y + 5);
    context.fillStyle = theme.alarm;
    queueBadge(context, labels("40", theme.paper, theme.alarm), x - 2, y - 1);
  }],
  ["taken for online, for gone, never seen", (context, theme, x, y) => {
    [1, 2, 0].forEach((state, k) => beliefMark(context, x + 18 * (k - 1), y, state, 0, theme));
  }],
  ["mistaken belief", (context, theme, x, y) => beliefMark(context, x, y, 1, 1, theme)],
  ["host without a body", (context, theme, x, y, labels) => {
    context.fillStyle = theme.ink;
    context.fillRect(x - 22, y - 5, 12, 10);
    putLabel(context, labels("base"), x - 5, y);
  }],
  ["time line: the fleet is split", (context, theme, x, y) => {
    context.fillStyle = theme.split;
    context.fillRect(x - 24, y - 10, 48, 20);
  }],
  ...[["collision", "collision"], ["host_stopped", "host stops"], ["late", "late message"],
    ["saturation", "first message dropped for a full queue"], ["partition", "split, or whole again"],
    ["out_of_memory", "a process is killed for memory"], ["missed_ticks", "timers miss ticks"],
  ].map(([kind, words]) => [`event: ${words}`, (context, theme, x, y) => {
    Object.assign(context, { font: `600 14px ${theme.sans}`, textAlign: "center",
      textBaseline: "middle", fillStyle: theme.alarm });
    context.fillText(EVENT_GLYPHS[kind], x, y);
  }]),
];

class Help {
  constructor(element, app) {
    Object.assign(this, { element, app });
    element.querySelector("#key-list").innerHTML = KEYS.map(([key, text]) =>
      `<dt><kbd>${SIGNS[key] ?? key}</kbd></dt><dd>${text}</dd>`).join("");
    const list = element.querySelector("#symbol-list");
    this.canvases = SYMBOLS.map(([words]) => {
      const term = document.createElement("dt"), text = document.createElement("dd");
      const canvas = document.createElement("canvas");
      canvas.style.cssText = `width:${SYMBOL_WIDTH}px;height:${SYMBOL_HEIGHT}px`;
      term.append(canvas);
      text.textContent = words;
      list.append(term, text);
      return canvas;
    });
    element.querySelector("button").addEventListener("click", () => this.close());
  }

  get isOpen() { return this.element.open; }

  open() {
    this.draw();
    this.element.showModal();
  }

  close() { this.element.close(); }

  draw() {
    const { theme } = this.app, ratio = devicePixelRatio || 1;
    const labels = (text, colour = theme.ink, halo = theme.halo) => LABELS.of(text,
      { font: `500 10.5px ${theme.sans}`, lineHeight: 13, colour, halo, ratio });
    SYMBOLS.forEach(([, draw], k) => {
      const context = sized(this.canvases[k], SYMBOL_WIDTH, SYMBOL_HEIGHT, ratio);
      context.fillStyle = theme.unknown;
      context.fillRect(0, 0, SYMBOL_WIDTH, SYMBOL_HEIGHT);
      context.save();
      draw(context, theme, SYMBOL_WIDTH / 2, SYMBOL_HEIGHT / 2, labels);
      context.restore();
    });
  }
}

function symbolRobot(context, theme, x, y, { hollow = false, chosen = false, up = true } = {}) {
  drawRobot(context, x, y, 0.3, 6, { colour: theme.hues[0], theme, hollow, chosen, up });
}

function symbolDot(context, theme, x, y) {
  context.fillStyle = theme.hues[0];
  context.beginPath();
  circle(context, x, y, 2.6);
  context.fill();
}

function symbolLine(context, x, y, style) {
  Object.assign(context, style);
  context.beginPath();
  line(context, x - 26, y, x + 26, y);
  context.stroke();
  context.globalAlpha = 1;
}
