// What is said of one cell: in a few lines beside the pointer, and in full with its command.
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
