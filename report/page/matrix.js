// The matrix of solvers × scenes: sorted by any column, as ratios to a pinned line if there is one.
const BLUES = d3.scaleLog().domain([1, 30]).range(["#9ec9e8", "#f4f9fd"]).clamp(true);
const NEAR = d3.scaleLog().domain([1e-5, 1]).range(["#9ec9e8", "#f4f9fd"]).clamp(true); // error over limit

function matrix(main) {
  const limit = Number(STATE.limit), {lines, fastest} = ranking(filtered(), limit);
  if (!lines.length) return main.append(el("p", {}, "No measurement passes the filters."));
  const scenes = DATA.scenes.filter(scene => lines.some(line => line.cells.has(scene.scene)));
  const base = lines.find(line => line.name === STATE.base);
  sorted(lines);
  const errors = STATE.metric === "error";
  const counted = errors ? "Error over the limit, the largest of the repeats. " : `Seconds (${METRICS[STATE.metric]}), medians of the repeats. `;
  const shade = errors ? "the darker the smaller the error" : "the darker the nearer to the fastest of the scene (bold)";
  main.append(el("p", {class: "note"},
    scenes.some(scene => scene.ladder) ? "" : "Each scene with its share of closed contacts. ", counted, base ? `Ratios to ${base.name}. ` : "",
    `Blue: within the limit, ${shade}; × outside the limit; ⊗ outside, though reported as solved; `
    + (lines.some(line => [...line.cells.values()].some(cell => cell.least_mm)) ? "on a rung, the limit is at least what conditioning allows; " : "")
    + "? cannot be judged, because the reference error bound is above a tenth of the limit; otherwise why there is no answer. "
    + "☆ pins a line as the baseline. Arrow keys move between cells, Enter opens the row."));
  const upright = scenes.length > 8 ? "upright" : "";
  const heads = [["rank", "#", "place in the ranking: share of scenes within the limit, then time over the fastest"],
    ["name", "solver (form)", ""], ["within", "within", "scenes within the limit, of those measured"],
    ["slower", "× fastest", "geometric mean of time over the fastest, on the scenes answered within the limit"],
    ...scenes.map(scene => [`scene ${scene.scene}`, scene.ladder ? scene.scene.split("/").slice(1).join("/") : scene.scene + closed(scene), `${scene.title} n = ${scene.n}, m = ${scene.m}, active ${scene.active}`])];
  const head = el("tr", {}, heads.map(([name, text, hint], place) => {
    const kind = place < 2 ? `stuck${place}` : place > 3 ? upright : "";
    const [button, more] = sorting(name, text, {hint, kind, mostFirst: name === "within"});
    return el("th", {scope: "col", ...more}, button);
  }));
  const body = lines.map(line => el("tr", {class: line === base ? "base" : ""},
    el("td", {class: "stuck0 number"}, String(line.rank)),
    el("th", {scope: "row", class: "stuck1"},
      el("button", {type: "button", class: "pin", "aria-pressed": String(line === base), "data-pin": line.name,
        title: line === base ? "unpin" : "pin as the baseline", onclick: () => update({base: line === base ? "" : line.name})},
      line === base ? "★" : "☆"),
      swatch(line.method),
      el("button", {type: "button", class: "name", title: "all of this solver", onclick: () => update({view: "solver", solver: line.method})}, line.name)),
    el("td", {class: "number"}, `${line.within} of ${line.scenes}`),
    el("td", {class: "number"}, Number.isFinite(line.slower) ? number(line.slower) : "–"),
    scenes.map(scene => cellOf(line.cells.get(scene.scene), limit, fastest.get(scene.scene), base?.cells.get(scene.scene), base))));
  const table = el("table", {class: "matrix"}, el("thead", {}, head), el("tbody", {}, body));
  table.querySelector("td[data-key]")?.setAttribute("tabindex", "0");
  moves(table);
  main.append(el("div", {class: "scroll", tabindex: "-1"}, table));
  main.append(el("p", {}, el("button", {type: "button", id: "csv", onclick: () => csv(lines, limit)}, "CSV of what is shown")));
}

function sorted(lines) {
  const of = STATE.sort.startsWith("scene ") ? STATE.sort.slice(6) : "";
  const limit = Number(STATE.limit);
  const value = line => {
    if (STATE.sort === "rank") return line.place;
    if (STATE.sort === "within") return line.within / line.scenes;
    if (!of) return line[STATE.sort];
    const cell = line.cells.get(of);
    if (!cell || figure(cell) == null) return Infinity;
    return STATE.metric === "error" || verdict(cell, limit) === "within" ? figure(cell) : 1e30 + figure(cell);
  };
  lines.sort((a, b) => (STATE.down ? -1 : 1) * d3.ascending(value(a), value(b)) || a.place - b.place);
}

function textOf(cell, judged, against, pinned) {
  if (judged === "no_answer") return cell.status === "time_limit" && cell.time_limit_s ? `> ${number(cell.time_limit_s)} s` : words(cell.status);
  const value = pinned ? (against && figure(against) ? figure(cell) / figure(against) : null) : figure(cell);
  return [number(value, pinned ? 2 : 3), claimed(cell, judged) ? "⊗" : VERDICTS[judged][1]].filter(Boolean).join(" ");
}

const closed = scene => scene.active == null || !scene.m ? "" : ` · ${Math.round(100 * scene.active / scene.m)} %`;
const claimed = (cell, judged) => judged === "outside" && cell.status === "solved";

function cellOf(cell, limit, fastest, against, pinned) {
  if (!cell) return el("td", {class: "none"});
  const judged = verdict(cell, limit), slower = timeOf(cell) / fastest, errors = STATE.metric === "error";
  return el("td", {
    class: `number ${judged} ${claimed(cell, judged) ? "claimed" : !errors && judged === "within" && slower === 1 ? "fastest" : ""}`, "data-key": cell.key, tabindex: "-1",
    style: judged === "within" ? `background:${errors ? NEAR(figure(cell) || 1e-9) : BLUES(slower || 1)}` : null, cell,
  }, textOf(cell, judged, against, pinned));
}

// One listener per table: description, row, and movement by the arrow keys.
function moves(table) {
  const at = event => event.target.closest("td[data-key]");
  table.addEventListener("mousemove", event => at(event) ? tip(described(at(event).cell), at(event), event) : noTip());
  table.addEventListener("mouseleave", noTip);
  table.addEventListener("focusin", event => at(event) ? tip(described(at(event).cell), at(event)) : noTip());
  table.addEventListener("focusout", noTip);
  table.addEventListener("click", event => at(event) && openRow(at(event).cell));
  table.addEventListener("keydown", event => {
    const node = at(event), step = {ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0]}[event.key];
    if (!node) return;
    if (event.key === "Enter" || event.key === " ") { event.preventDefault(); openRow(node.cell); }
    if (!step) return;
    event.preventDefault();
    const next = table.rows[node.parentNode.rowIndex + step[0]]?.cells[node.cellIndex + step[1]];
    if (!next?.dataset.key) return;
    node.tabIndex = -1;
    next.tabIndex = 0;
    next.focus();
  });
}

function csv(lines, limit) {
  const names = ["scene", "n", "m", "active", "label", "solver", "form", "variant", "tolerance", "threads", "status", "load_case_s",
    "least_s", "most_s", "total_s", "scene_s", "repeats", "iterations", "inner_iterations", "displacement_error_mm", "bound_mm",
    "peak_rss_mib", "machine", "commit", "recorded_at", "key"];
  const cells = lines.flatMap(line => [...line.cells.values()]);
  download("rows.csv", [[...names, "limit_mm", "verdict"],
    ...cells.map(cell => [...names.map(name => cell[name]), limitOf(cell, limit), verdict(cell, limit)])]);
}

// All rungs at once: a square per solver and rung, in the colour of its verdict; each ladder grows harder to the right.
function ladderView(main) {
  const limit = Number(STATE.limit), {lines} = ranking(filtered(), limit);
  const rungs = DATA.scenes.filter(scene => scene.ladder && lines.some(line => line.cells.has(scene.scene)));
  if (!rungs.length) return main.append(el("p", {}, "No rung passes the filters."));
  const ladders = d3.nest().key(scene => scene.ladder).entries(rungs), ends = new Set(ladders.map(({values}) => values[values.length - 1]));
  lines.sort((a, b) => DATA.order.findIndex(label => label.startsWith(a.name)) - DATA.order.findIndex(label => label.startsWith(b.name)));
  const square = (line, scene) => {
    const cell = line.cells.get(scene.scene), judged = cell && verdict(cell, limit);
    return el("td", {class: `${cell ? `number ${judged} ${claimed(cell, judged) ? "claimed" : ""}` : "none"} ${ends.has(scene) ? "last" : ""}`, ...(cell ? {"data-key": cell.key, tabindex: "-1", cell} : {})});
  };
  const table = el("table", {class: "matrix squares", style: `--side:${Math.max(8, Math.min(20, Math.floor(1000 / rungs.length)))}px`}, el("thead", {}, el("tr", {}, el("th", {scope: "col"}, "solver (form)"),
    ladders.map(({key, values}) => el("th", {scope: "col", colspan: values.length, class: "upright"}, el("span", {}, key))))),
  el("tbody", {}, lines.map(line => el("tr", {}, el("th", {scope: "row"}, line.name), rungs.map(scene => square(line, scene))))));
  table.querySelector("td[data-key]")?.setAttribute("tabindex", "0");
  moves(table);
  main.append(el("p", {class: "note"}, "A square per rung; each ladder grows harder to the right. Blue: correct; pale orange: wrong; dark orange: wrong, though reported as solved; "
    + "grey: no answer; hatched: cannot be judged; white: not run. A click or Enter opens the row."), el("div", {class: "scroll"}, table));
}
