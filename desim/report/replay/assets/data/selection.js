// What is selected: a robot, a link (two hosts), a family of topics, a message, or nothing ({}).

// The two hosts of a selected link or message; null: something else is selected.
function pairOf(run, selection) {
  if (selection.kind === "link") return [selection.one, selection.other];
  if (selection.kind !== "message") return null;
  const { source, destination } = run.message.at;
  return [source[selection.message], destination[selection.message]];
}

// The selection of one run in terms of another, by names; nothing where that has no such thing.
function translated(selection, from, to) {
  const same = (one, other, index) => other.indexOf(one[index]);
  if (selection.kind === "robot") {
    const robot = same(from.robots, to.robots, selection.robot);
    return robot < 0 ? {} : { kind: "robot", robot };
  }
  if (selection.kind === "family") {
    const family = same(from.about.families, to.about.families, selection.family);
    return family < 0 ? {} : { kind: "family", family };
  }
  const pair = pairOf(from, selection)?.map((host) => same(from.hosts, to.hosts, host));
  return !pair || pair.some((host) => host < 0) ? {} : { kind: "link", one: pair[0], other: pair[1] };
}

// Whether the selection leaves a pair of hosts in the light.
function isLit(run, selection, one, other) {
  if (selection.kind === "robot") {
    const host = run.hostOfRobot[selection.robot];
    return one === host || other === host;
  }
  const pair = pairOf(run, selection);
  return !pair || (one === pair[0] && other === pair[1]) || (one === pair[1] && other === pair[0]);
}

// Whether it leaves only some pairs of hosts in the light: a family of topics is everywhere.
function isNarrow(run, selection) {
  return selection.kind === "robot" || pairOf(run, selection) !== null;
}

// One word for a selection, to tell it from others.
function keyOfSelection(selection) {
  return Object.values(selection).join(" ");
}
