// What is said of one cell, in a few lines and in full with its command; all that was measured of one solver;
// what changed between two runs.
function described(cell) {
  const limit = Number(STATE.limit), spread = cell.least_s < cell.most_s ? ` (${number(cell.least_s, 2)} to ${number(cell.most_s, 2)})` : "";
  const inner = cell.inner_iterations ? ` (${number(cell.inner_iterations)} inner)` : "";
  return [
    `${cell.label} on ${cell.scene}`,
    cell.load_case_s == null ? null : `${number(cell.load_case_s)} s per load case${spread}; ${number(cell.total_s)} s with preparation`
      + (cell.scene_s == null ? "" : `; ${number(cell.scene_s)} s from the scene`),
    cell.iterations == null ? null : `${number(cell.iterations)} steps${inner}`,
    `error ${number(cell.displacement_error_mm)} mm; reference error bound ${number(cell.bound_mm)} mm`,
    `${VERDICTS[verdict(cell, limit)][0]} (limit ${tidy(limitOf(cell, limit))} mm); the solver reported: ${words(cell.status)}`,
    `${cell.options ? `${cell.options}; ` : ""}tolerance ${tidy(cell.tolerance)}, ${number(cell.threads)} thread${cell.threads === 1 ? "" : "s"}`,
    [cell.solver_version && `version ${cell.solver_version}`, cell.solver_code && `code ${cell.solver_code}`,
      cell.commit && `commit ${cell.commit.slice(0, 10)}`].filter(Boolean).join(", "),
  ].filter(Boolean);
}

const quoted = text => /^[\w./=+:-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`;

function command(cell) {
  return `python -m harness run ${quoted(DATA.directory)} --key ${quoted(cell.key)} --out results/again`;
}

function openRow(cell) {
  noTip();
  const dialog = document.getElementById("row");
  const {label, method, verdict: inRow, ...others} = cell;
  const shown = {...others, "verdict in the row": words(inRow), "verdict at the limit shown": VERDICTS[verdict(cell, Number(STATE.limit))][0], "limit shown, mm": Number(STATE.limit)};
  const facts = Object.entries(shown).filter(([, value]) => value != null && value !== "");
  const again = command(cell);
  dialog.replaceChildren(
    el("h2", {id: "row-title"}, `${cell.label} on ${cell.scene}`),
    el("p", {}, SCENES.get(cell.scene)?.title ?? ""),
    cell.key ? el("div", {class: "command"}, el("p", {}, "To measure it again:"), el("code", {}, again),
      el("button", {type: "button", onclick: () => navigator.clipboard?.writeText(again)}, "copy")) : "",
    el("div", {class: "scroll"}, factTable(facts.map(([name, value]) => [words(name), String(value)]))),
    el("button", {type: "button", onclick: () => dialog.close()}, "close"));
  if (!dialog.open) dialog.showModal();
  remember({row: cell.key ?? ""});
}

// All that was measured of one solver.
function solverView(main) {
  const names = known(CELLS);
  const chosen = names.includes(STATE.solver) ? STATE.solver : names[0];
  const limit = Number(STATE.limit), {fastest} = ranking(filtered(), limit);
  const cells = filtered().filter(cell => cell.method === chosen);
  main.append(el("p", {}, options("solver", "solver", names.map(name => [name, name]), "")));
  document.getElementById("solver").value = chosen;
  if (!cells.length) return main.append(el("p", {}, "None of its measurements passes the filters."));
  const counts = Object.entries(VERDICTS).map(([name, [text]]) => [cells.filter(cell => verdict(cell, limit) === name).length, text]).filter(([count]) => count);
  const versions = [...new Set(cells.map(cell => [cell.solver_version && `version ${cell.solver_version}`, cell.solver_code && `code ${cell.solver_code}`].filter(Boolean).join(", ")))];
  main.append(el("p", {}, `${cells.length} measurements at the limit ${tidy(limit)} mm: ${counts.map(([count, text]) => `${count} ${text}`).join(", ")}. ${versions.filter(Boolean).join("; ")}`),
    breaks(cells, limit), el("p", {class: "note"}, "A row can be opened by a click or Enter."));
  const columns = [
    ["scene", cell => cell.scene], ["tolerance", cell => tidy(cell.tolerance), 1], ["threads", cell => number(cell.threads), 1],
    ["verdict", cell => VERDICTS[verdict(cell, limit)][0]], ["reported", cell => words(cell.status)],
    ["error, mm", cell => number(cell.displacement_error_mm), 1], ["error / limit", cell => number(cell.displacement_error_mm == null ? null : cell.displacement_error_mm / limitOf(cell, limit)), 1],
    ["bound, mm", cell => number(cell.bound_mm), 1], ["steps", cell => number(cell.iterations), 1],
    ["load case, s", cell => number(cell.load_case_s), 1], ["spread, s", cell => cell.least_s < cell.most_s ? `${number(cell.least_s, 2)} to ${number(cell.most_s, 2)}` : "", 1],
    ["with preparation, s", cell => number(cell.total_s), 1], ["× fastest", cell => verdict(cell, limit) === "within" ? number(timeOf(cell) / fastest.get(cell.scene)) : "–", 1],
    ["peak, MiB", cell => number(cell.peak_rss_mib), 1],
  ];
  const table = tableOf(columns, cells, {cell: (cell, k) => ({
    class: `${columns[k][2] ? "number" : ""} ${k === 3 ? verdict(cell, limit) : ""}`, "data-key": cell.key, tabindex: k ? "-1" : "0", cell,
  })});
  moves(table);
  main.append(el("div", {class: "scroll"}, table));
}

// On ladders: the first rung of each without a correct answer.
function breaks(cells, limit) {
  const rungs = DATA.scenes.filter(scene => scene.ladder && cells.some(cell => cell.scene === scene.scene));
  if (!rungs.length) return "";
  const missed = scene => !cells.some(cell => cell.scene === scene.scene && verdict(cell, limit) === "within");
  const first = d3.nest().key(scene => scene.ladder).entries(rungs).map(({key, values}) => [key, values.find(missed)]);
  const at = first.filter(([, scene]) => scene).map(([, scene]) => scene.scene.split("/").slice(1).join("/"));
  const never = first.filter(([, scene]) => !scene).map(([name]) => name);
  return el("p", {id: "breaks"}, el("b", {}, at.length ? `Breaks at ${at.join(", ")}. ` : ""), never.length ? `Correct on every rung of ${never.join(", ")}.` : "");
}

// What changed between two runs, measurement by measurement.
function compareView(main) {
  const columns = DATA.columns, text = value => typeof value === "number" ? number(value) : String(value ?? "–");
  for (const pair of DATA.comparisons) {
    const lines = pair.lines.filter(line => (!STATE.change || line.group === STATE.change)
      && (!STATE.search || line.measurement.toLowerCase().includes(STATE.search.toLowerCase())));
    const name = columns.find(([column]) => column === STATE.sort)?.[0];
    if (name) lines.sort((a, b) => (STATE.down ? -1 : 1) * d3.ascending(a[name] ?? Infinity, b[name] ?? Infinity));
    const shown = columns.map(([column, heading, right]) => {
      const [button, more] = sorting(column, heading, {kind: right ? "number" : ""});
      return [button, line => text(line[column]), right, more];
    });
    main.append(el("h2", {}, `${pair.old} → ${pair.new}`), el("p", {}, pair.summary),
      el("div", {class: "scroll"}, tableOf(shown, lines, {row: line => ({class: `change-${line.group.split(" ")[0]}`})})),
      el("p", {}, `${lines.length} of ${pair.lines.length} measurements. `, el("button", {type: "button", onclick: () =>
        download("comparison.csv", [columns.map(([column]) => column), ...lines.map(line => columns.map(([column]) => line[column]))])}, "CSV of what is shown")));
  }
}

function compareControls() {
  const groups = [...new Set(DATA.comparisons.flatMap(pair => pair.lines.map(line => line.group)))];
  return [options("change", "change", groups.map(name => [name, name])),
    el("label", {}, "measurement ", el("input", {id: "search", type: "search", value: STATE.search, onchange: event => update({search: event.target.value})}))];
}
