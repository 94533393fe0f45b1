// The list of events; the last one that has happened is marked.

class EventList {
  constructor(element, app) {
    this.app = app;
    this.list = element.querySelector("ol");
    this.events = eventsOf(app);
    this.times = Float64Array.from(this.events, (event) => event.timeS);
    this.items = this.events.map((event) => this.#item(event));
    this.list.replaceChildren(...this.items);
    element.hidden = this.events.length === 0;
    this.marked = -1;
  }

  #item(event) {
    const { app } = this, item = document.createElement("li");
    item.innerHTML = "<button><time></time><i></i><span></span></button>";
    const button = item.firstChild;
    button.querySelector("time").textContent = clock(event.timeS);
    button.querySelector("i").textContent = EVENT_GLYPHS[event.kind] ?? "·";
    const run = app.runs.length > 1 && event.which !== null ? `${"AB"[event.which]}: ` : "";
    button.querySelector("span").textContent = run + event.text;
    button.classList.toggle("bad", BAD.has(event.kind));
    button.addEventListener("click", () => {
      app.seek(event.timeS);
      const robot = app.runs[0].robots.indexOf(event.subjects[0]);
      if (robot >= 0) app.select({ kind: "robot", robot });
    });
    return item;
  }

  draw() {
    const at = countUpTo(this.times, this.app.player.timeS + 1e-9) - 1, { list } = this;
    if (at === this.marked) return;
    this.items[this.marked]?.classList.remove("now");
    this.items[at]?.classList.add("now");
    this.marked = at;
    const item = this.items[at];
    if (list.scrollHeight > list.clientHeight) {
      list.scrollTop = item ? item.offsetTop - list.offsetTop - list.clientHeight / 2 : 0;
    }
  }
}

// The events of all runs by time, and the first difference of two.
function eventsOf({ runs, difference }) {
  const all = runs.flatMap((run, which) => run.events.map((event) => ({ ...event, which })));
  if (difference) {
    all.push({ timeS: difference.timeS, kind: "difference", which: null,
      text: `first difference: ${difference.robot} is `
        + `${Math.round(1000 * difference.awayM)} mm elsewhere`, subjects: [difference.robot] });
  }
  return all.sort((a, b) => a.timeS - b.timeS);
}
