// The matrix of solvers and scenes, the ladders, and the measurements of one solver.
const box = document.getElementById("tables"), dialog = document.getElementById("row");

// The cell of a measurement in the colour of its verdict, the paler the slower; a click or Enter opens its row.
function cellOf(cell, text) {
  if (!cell) return el("td");
  const open = () => update({row: cell.key}), pale = text ? 60 * Math.log10(cell.slower ?? 1) : 0;
  return el("td", {
    class: `${cell.judged} ${cell.claimed}`, title: described(cell), "data-key": cell.key, tabindex: 0,
    style: `--pale: ${Math.min(pale, 90)}%`, onclick: open, onkeydown: event => event.key === "Enter" && open(),
  }, text);
}

function described(cell) {
  return `${cell.label} on ${cell.scene}\n${number(cell.load_case_s)} s per load case, `
    + `${number(cell.total_s)} s with preparation\nerror ${number(cell.displacement_error_mm)} mm: `
    + `${words(cell.judged)}; the solver reported: ${words(cell.status)}`;
}

function textOf(cell, base) {
  const seconds = cell.status === "time_limit" && cell.time_limit_s;
  if (cell.judged === "no_answer") return seconds ? `> ${number(seconds)} s` : words(cell.status);
  const mark = cell.claimed ? "⊗" : {outside: "×", cannot_be_judged: "?"}[cell.judged] ?? "";
  return `${number(cell.shown && cell.shown / base)} ${mark}`;
}

// A column per scene; on ladders a square per rung, which grow harder to the right.
function matrix() {
  const cells = filtered(), lines = ranking(cells), base = lines.find(line => line.method === at("base"));
  const against = scene => base ? base.best[scene]?.shown ?? NaN : 1;
  const squares = at("view") === "ladders", tried = new Set(cells.map(cell => cell.scene));
  const scenes = DATA.scenes.filter(({scene, ladder}) => tried.has(scene) && (ladder || !squares));
  const columns = scenes.map(({scene, ladder, heading}, k) => [
    !squares ? heading : ladder === scenes[k - 1]?.ladder ? "" : ladder,
    ({best}) => best[scene]?.judged === "within" ? best[scene].shown : null,
    ({best}) => cellOf(best[scene], squares || !best[scene] ? "" : textOf(best[scene], against(scene))),
  ]);
  const heads = [
    ["solver (form)", line => line.name, line => el("th", {}, swatch(line.method), line.name)],
    ["#", line => line.rank],
    ["within", line => -line.share, line => el("td", {}, `${line.within} of ${line.scenes}`)],
    ["× fastest", line => line.slower],
  ].slice(0, squares ? 1 : 4);
  const kind = squares ? "squares upright" : scenes.length > 8 ? "upright" : "";
  box.replaceChildren(tableOf([...heads, ...columns], lines, kind));
}

// All that was measured of one solver, and the first rung of each ladder without a correct answer.
function oneSolver() {
  const name = at("solver") || DATA.methods[0], cells = filtered().filter(cell => cell.method === name);
  const ofScenes = Map.groupBy(cells, cell => cell.scene), wrong = cell => cell.judged !== "within";
  const missed = DATA.scenes.filter(({ladder, scene}) => ladder && ofScenes.get(scene)?.every(wrong));
  const breaks = missed.filter(({ladder}, k) => ladder !== missed[k - 1]?.ladder).map(({heading}) => heading);
  const bound = column => column === "bound_mm" && (cell => el("td", {}, number(raised(cell[column]))));
  const columns = DATA.columns.map(([column, text]) => [text, cell => cell[column], bound(column)]);
  columns.splice(1, 0, ["verdict", cell => cell.judged, cell => cellOf(cell, words(cell.judged))]);
  box.replaceChildren(el("h2", {}, swatch(name), name), tableOf(columns, cells),
    el("p", {id: "breaks"}, breaks.length ? `Breaks at ${breaks.join(", ")}.` : ""));
}

// All that is known of the row that the address names, of the chosen machine where there are several, and the
// command that measures it again.
function openRow() {
  const own = ({machine}) => !at("machine") || machine === at("machine");
  const cell = CELLS.find(each => each.key && each.key === at("row") && own(each));
  if (!cell) return dialog.close();
  const quoted = text => /^[\w./=+:-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`;
  const place = `${quoted(DATA.directory)} --key ${quoted(cell.key)}`;
  const facts = Object.keys(DATA.cells).filter(name => cell[name] != null && cell[name] !== "");
  dialog.replaceChildren(el("form", {method: "dialog"}, el("button", {}, "close")),
    el("h2", {}, `${cell.label} on ${cell.scene}`),
    el("p", {}, "To measure it again: ", el("code", {}, `python -m harness run ${place} --out results/again`)),
    el("table", {}, facts.map(name => el("tr", {}, el("th", {}, words(name)), el("td", {},
      name === "log" ? el("a", {href: `../${cell.log}`}, cell.log) : String(cell[name]))))));
  if (!dialog.open) dialog.showModal();
}
