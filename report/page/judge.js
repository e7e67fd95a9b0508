// Verdicts at any limit as the judge gives them, filters, and the ranking.
const BOUND_SHARE = 0.1;
// Texts come as their distinct values and the place of each.
const LISTS = Object.entries(DATA.cells ?? {}).map(([name, list]) =>
  [name, list.places?.map(place => list.distinct[place]) ?? list]);
const CELLS = (LISTS[0]?.[1] ?? []).map((_, i) => Object.fromEntries(LISTS.map(([name, list]) => [name, list[i]])));

function verdict(cell) {
  if (cell.verdict === "no_answer") return "no_answer";
  if (cell.bound_mm == null || !(cell.bound_mm <= BOUND_SHARE * cell.limit_mm)) return "cannot_be_judged";
  return cell.over != null && cell.displacement_error_mm <= cell.limit_mm ? "within" : "outside";
}

// The limit of the slider, mm: of two digits, and where it stands at its start that of the rows.
function limitAsked() {
  return at("limit") === START.get("limit") ? DATA.limit_mm : Number((10 ** -at("limit")).toPrecision(2));
}

// The cells that the filters leave, judged at that limit. `slower`: seconds over the fastest.
function filtered() {
  const limit = limitAsked(), metric = at("metric");
  for (const cell of CELLS) {
    cell.limit_mm = Math.max(limit, cell.least_mm ?? 0);
    cell.over = cell.displacement_error_mm == null ? null : cell.displacement_error_mm / cell.limit_mm;
    cell.judged = verdict(cell);
    cell.claimed = cell.judged === "outside" && cell.status === "solved" ? "claimed" : "";
    cell.seconds = cell[metric === "over" ? "load_case_s" : metric];
    cell.shown = cell[metric];
    cell.slower = null;
    cell.alpha = at("solver") && at("solver") !== cell.method ? 0.1 : 1;
  }
  const cells = CELLS.filter(cell => DATA.filters.every(name => !at(name) || cell[name] == at(name)));
  const within = cells.filter(cell => cell.judged === "within");
  form.elements.counts.textContent = `${number(limit)} mm: ${within.length} of ${cells.length} measurements within`;
  for (const own of Map.groupBy(within.filter(cell => cell.seconds > 0), cell => cell.scene).values())
    for (const cell of own) cell.slower = cell.seconds / Math.min(...own.map(({seconds}) => seconds));
  return cells;
}

// Of several tolerances on a scene, first the fastest within the limit, then the most accurate.
function better(a, b) {
  const within = cell => cell.judged === "within", key = within(a) ? "seconds" : "displacement_error_mm";
  return within(b) - within(a) || compared(a[key], b[key]);
}

// The lines of the matrix by the share of scenes within the limit, then by the time over the fastest.
function ranking(cells) {
  const lines = [...Map.groupBy(cells, cell => cell[at("lines")])].map(([name, own]) => {
    const best = Object.fromEntries(own.toSorted(better).reverse().map(cell => [cell.scene, cell]));
    const logs = Object.values(best).filter(cell => cell.slower).map(cell => Math.log(cell.slower));
    const slower = logs.length ? Math.exp(logs.reduce((sum, log) => sum + log) / logs.length) : null;
    const within = Object.values(best).filter(cell => cell.judged === "within").length;
    const scenes = Object.keys(best).length;
    return {name, method: own[0].method, best, scenes, within, share: within / scenes, slower};
  });
  lines.sort((a, b) => b.share - a.share || b.within - a.within || compared(a.slower, b.slower));
  lines.forEach((line, place) => { line.rank = line.within ? place + 1 : null; });
  return lines;
}
