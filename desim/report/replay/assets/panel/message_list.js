// The messages of what is selected that came to their ends last, and where the time of one went.

const LISTED = 7;
const SEARCHED = 20000;  // messages, back from the instant that is shown

class MessageList {
  constructor(element, app) {
    this.app = app;
    this.run = app.runs[0];
    this.element = element;
    this.list = element.querySelector("ol");
    this.card = element.querySelector("#message");
    this.refresh();
  }

  // Index what the run has.
  refresh() {
    const at = this.run.message.at, count = this.run.message.length;
    this.ends = Float64Array.from({ length: count }, (_, k) => at.born_us[k] + at.flight_us[k]);
    this.byEnd = Int32Array.from({ length: count }, (_, k) => k);
    this.byEnd.sort((a, b) => this.ends[a] - this.ends[b]);
    this.sortedEnds = Float64Array.from(this.byEnd, (k) => this.ends[k]);
    this.element.hidden = count === 0;
    this.key = null;
  }

  #isWanted(k) {
    const { selection } = this.app, { source, destination, topic } = this.run.message.at;
    if (selection.kind === "family") return this.run.about.topic_family[topic[k]] === selection.family;
    return isLit(this.run, selection, source[k], destination[k]);
  }

  draw() {
    if (this.element.hidden) return;
    const found = [], { player } = this.app;
    const last = countUpTo(this.sortedEnds, player.timeS * 1e6 + 0.5) - 1;
    for (let i = last; i >= 0 && i > last - SEARCHED && found.length < LISTED; i--) {
      if (this.#isWanted(this.byEnd[i])) found.push(this.byEnd[i]);
    }
    const chosen = this.app.selection.kind === "message" ? this.app.selection.message : -1;
    const key = `${found.join()} ${chosen}`;
    if (key === this.key) return;
    this.key = key;
    this.list.replaceChildren(...found.map((k) => this.#item(k, chosen)));
    this.card.hidden = chosen < 0;
    if (chosen >= 0) this.#story(chosen);
  }

  #item(k, chosen) {
    const { run } = this, at = run.message.at, item = document.createElement("li");
    item.innerHTML = "<button><time></time><span></span><b></b></button>";
    const button = item.firstChild;
    button.classList.toggle("chosen", k === chosen);
    button.classList.toggle("bad", at.reason[k] > 0 || this.app.scenes[0].traffic.isLate(k));
    item.querySelector("time").textContent = clock(this.ends[k] / 1e6);
    item.querySelector("span").textContent = `${shortName(run.hosts[at.source[k]])} → `
      + `${shortName(run.hosts[at.destination[k]])}  ${this.#topic(at.topic[k])}`;
    item.querySelector("b").textContent = at.reason[k] ? run.about.reasons[at.reason[k]]
      : quantity(at.flight_us[k] / 1e6, "s");
    button.addEventListener("click", () => this.app.select({ kind: "message", message: k }));
    return item;
  }

  // A topic without the names of hosts: /robot_3/scan is scan.
  #topic(topic) {
    const words = this.run.about.topics[topic].split("/");
    return words.filter((word) => word && !this.run.hosts.includes(word)).join("/") || words.at(-1);
  }

  // One message: what it was, and its time as a bar.
  #story(k) {
    const { run } = this, at = run.message.at, lost = at.reason[k] > 0;
    const kept = run.partsOf(k), parts = kept ?? this.#rough(k);
    const total = parts.reduce((sum, one) => sum + one.s, 0), took = quantity(at.flight_us[k] / 1e6, "s");
    this.card.innerHTML = "<p><b></b></p><p class='what'></p><div class='waterfall'></div><dl></dl>"
      + "<p class='hint'></p>";
    this.card.querySelector("b").textContent = `Message ${at.number[k]}`;
    this.card.querySelector(".what").textContent = `${run.about.topics[at.topic[k]]}, `
      + `${run.hosts[at.source[k]]} → ${run.hosts[at.destination[k]]}, `
      + `${at.size_bytes[k].toLocaleString("en")} B, born at ${(at.born_us[k] / 1e6).toFixed(6)} s, `
      + (lost ? `lost after ${took}: ${run.about.reasons[at.reason[k]]}` : `delivered after ${took}`);
    const { hues } = this.app.theme, kinds = [...new Set(parts.map((one) => one.part))];
    for (const { part, place, s } of parts) {
      const colour = hues[kinds.indexOf(part) % hues.length];
      const bar = document.createElement("i");
      bar.style.cssText = `--key:${colour};flex:${Math.max(s / Math.max(total, 1e-12), 1e-4)}`;
      bar.title = [part, placeWords(place)].filter(Boolean).join(" ");
      const term = document.createElement("dt"), value = document.createElement("dd");
      term.style.setProperty("--key", colour);
      term.textContent = part;
      term.append(Object.assign(document.createElement("small"), { textContent: placeWords(place) }));
      value.textContent = quantity(s, "s");
      this.card.querySelector(".waterfall").append(bar);
      this.card.querySelector("dl").append(term, value);
    }
    this.card.querySelector(".hint").textContent = kept ? "" : "The parts: desim why RUN "
      + `--message ${at.number[k]}; a run with trace.ledger has them here.`;
  }

  // Without a ledger: before its first frame left, and from then on.
  #rough(k) {
    const { left_us: left, flight_us: flight, source } = this.run.message.at;
    const waited = left[k] < 0 ? flight[k] : left[k], place = this.run.hosts[source[k]];
    return [{ part: "before its first frame", place, s: waited / 1e6 },
      { part: "from its first frame on", place: "", s: (flight[k] - waited) / 1e6 }];
  }
}
