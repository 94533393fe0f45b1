// Keys. The help lists the same table.

const KEYS = [
  ["Space", "play, pause", (app) => { app.player.toggle(); app.changed(); }],
  ["ArrowRight", "a second on; with Shift ten", (app, big) => app.seek(app.player.timeS + (big ? 10 : 1))],
  ["ArrowLeft", "a second back; with Shift ten", (app, big) => app.seek(app.player.timeS - (big ? 10 : 1))],
  [".", "a tenth of a second on", (app) => app.seek(app.player.timeS + 0.1)],
  [",", "a tenth of a second back", (app) => app.seek(app.player.timeS - 0.1)],
  ["Home", "to the start", (app) => app.seek(app.player.startS)],
  ["End", "to the end; of a run that goes on: follow it", (app) => app.toEnd()],
  ["]", "to the next event", (app) => app.step(1)],
  ["[", "to the event before", (app) => app.step(-1)],
  ["+", "faster", (app) => app.faster(1)],
  ["-", "slower", (app) => app.faster(-1)],
  ["n", "select the next robot; with Shift the one before", (app, big) => app.next(big ? -1 : 1)],
  ["f", "follow the selected robot", (app) => app.follow()],
  ["0", "the whole terrain", (app) => app.stage.fit()],
  ["g", "two runs: side by side, or ghosts", (app) => app.switchMode()],
  ["m", "messages", (app) => app.switchLayer("messages")],
  ["t", "light or dark", (app) => app.switchTheme()],
  ["Escape", "select nothing", (app) => app.select({})],
  ["?", "what is drawn, and these keys", (app) => app.help.open()],
];
const ALIASES = { " ": "Space", "=": "+", "_": "-", N: "n" };
const SIGNS = { ArrowRight: "→", ArrowLeft: "←", Escape: "Esc" };

function listenToKeys(app) {
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.matches?.("input, select, textarea") && event.key !== "Escape") return;
    if (app.help.isOpen) {
      if (event.key === "?") { event.preventDefault(); app.help.close(); }
      return;
    }
    const name = ALIASES[event.key] ?? event.key;
    // Space on a focused button would press it as well.
    if (event.target.matches?.("button") && name === "Space") event.target.blur();
    const found = KEYS.find(([key]) => key === name);
    if (!found) return;
    event.preventDefault();
    found[2](app, event.shiftKey);
  });
}
