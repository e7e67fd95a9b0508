// Verdicts at any limit as judge.py gives them, filters, and the ranking.
const CELLS = DATA.kind === "run" ? rowsOf(DATA.cells) : [];
const SCENES = new Map((DATA.scenes ?? []).map(scene => [scene.scene, scene]));
const BOUND_SHARE = 0.1;
const METRICS = {
  load_case_s: "load case", total_s: "with preparation", scene_s: "from the scene", error: "error / limit",
};
const VERDICTS = {
  within: ["within", ""], outside: ["outside the limit", "×"],
  cannot_be_judged: ["cannot be judged", "?"], no_answer: ["no answer", "–"],
};
for (const cell of CELLS) {
  cell.total_s = cell.load_case_s == null ? null : cell.load_case_s + (cell.once_s ?? 0);
  cell.ladder = SCENES.get(cell.scene)?.ladder ?? "";
}

const limitOf = (cell, limit) => Math.max(limit, cell.least_mm ?? 0);

function verdict(cell, limit) {
  if (cell.verdict === "no_answer") return "no_answer";
  const own = limitOf(cell, limit);
  if (cell.bound_mm == null || !(cell.bound_mm <= BOUND_SHARE * own)) return "cannot_be_judged";
  return cell.displacement_error_mm != null && cell.displacement_error_mm <= own ? "within" : "outside";
}

// What the cell shows: seconds in the chosen way of counting, or its error over the limit.
function figure(cell) {
  if (STATE.metric !== "error") return cell[STATE.metric];
  if (cell.displacement_error_mm == null) return null;
  return cell.displacement_error_mm / limitOf(cell, Number(STATE.limit));
}
const timeOf = cell => cell[STATE.metric === "error" ? "load_case_s" : STATE.metric];

const CONTACT = {"up to 10 %": [0, 0.1], "10 to 50 %": [0.1, 0.5], "above 50 %": [0.5, 1.01]};
const distinct = name => [...new Set(CELLS.map(cell => cell[name]))].filter(value => value !== "" && value != null);
const ascending = name => distinct(name).sort(d3.ascending).map(value => [String(value), String(value)]);

// name: [label, options [[value, text]], test]. Machines are never mixed: one of them is always chosen.
const FILTERS = {
  machine: ["machine", () => distinct("machine").map(name => [name, name]), (cell, value) => cell.machine === value],
  size: ["size n", () => ascending("n"), (cell, value) => cell.n === Number(value)],
  contact: ["contact", () => Object.keys(CONTACT).map(name => [name, name]), (cell, value) => {
    const share = cell.active / cell.m, [low, high] = CONTACT[value] ?? [0, 2];
    return share >= low && share < high;
  }],
  form: ["form", () => ascending("form"), (cell, value) => cell.form === value],
  threads: ["threads", () => ascending("threads"), (cell, value) => cell.threads === Number(value)],
  owner: ["solvers", () => [["ours", "ours"], ["textbook", "textbook"], ["library", "libraries"]],
    (cell, value) => cell.owner === value],
  tolerance: ["tolerance", () => distinct("tolerance").sort(d3.descending).map(value => [String(value), tidy(value)]),
    (cell, value) => cell.tolerance === Number(value)],
  ladder: ["ladder", () => distinct("ladder").map(name => [name, name]), (cell, value) => cell.ladder === value],
  status: ["verdict or status", () => [...Object.entries(VERDICTS).map(([name, [text]]) => [name, text]),
    ...distinct("status").map(name => [`status ${name}`, `reported: ${words(name)}`])],
    (cell, value) => value.startsWith("status ") ? cell.status === value.slice(7)
      : verdict(cell, Number(STATE.limit)) === value],
};

function filtered() {
  const machine = STATE.machine || distinct("machine")[0] || "";
  const chosen = {...Object.fromEntries(Object.keys(FILTERS).map(name => [name, STATE[name]])), machine};
  const tests = Object.entries(chosen).filter(([, value]) => value).map(([name, value]) => cell => FILTERS[name][2](cell, value));
  return CELLS.filter(cell => tests.every(test => test(cell)));
}

// Of several tolerances on a scene: the fastest within the limit, else the most accurate.
function better(one, other, limit) {
  const within = [one, other].map(cell => verdict(cell, limit) === "within");
  if (within[0] !== within[1]) return within[0] ? one : other;
  if (within[0]) return (timeOf(other) ?? Infinity) < (timeOf(one) ?? Infinity) ? other : one;
  const error = cell => cell.displacement_error_mm ?? Infinity;
  return error(other) < error(one) ? other : one;
}

// The lines of the matrix, ranked: the share of scenes within the limit, then the time over the fastest.
function ranking(cells, limit) {
  const lines = new Map();
  for (const cell of cells) {
    const name = STATE.rows === "best" ? cell.method : cell.label;
    if (!lines.has(name)) lines.set(name, {name, method: cell.method, solver: cell.solver, cells: new Map()});
    const of = lines.get(name).cells, known = of.get(cell.scene);
    of.set(cell.scene, known ? better(known, cell, limit) : cell);
  }
  const fastest = new Map();
  const good = cell => verdict(cell, limit) === "within" && timeOf(cell) > 0;
  for (const line of lines.values())
    for (const [scene, cell] of line.cells)
      if (good(cell)) fastest.set(scene, Math.min(fastest.get(scene) ?? Infinity, timeOf(cell)));
  for (const line of lines.values()) {
    const all = [...line.cells.values()], within = all.filter(good);
    const missing = all.filter(cell => verdict(cell, limit) === "no_answer").length;
    const slower = within.length ? Math.exp(d3.mean(within, cell => Math.log(timeOf(cell) / fastest.get(cell.scene)))) : Infinity;
    Object.assign(line, {scenes: all.length, within: within.length, slower, missing,
      worst: d3.max(all, cell => cell.displacement_error_mm) ?? Infinity});
  }
  const ranked = [...lines.values()].sort((a, b) => b.within / b.scenes - a.within / a.scenes || b.within - a.within
    || d3.ascending(a.slower, b.slower) || a.missing - b.missing || d3.ascending(a.worst, b.worst));
  // Without an answer within the limit there is no rank.
  ranked.forEach((line, place) => Object.assign(line, {place, rank: line.within ? place + 1 : "–"}));
  return {lines: ranked, fastest};
}
