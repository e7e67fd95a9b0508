// Shared by the figures: the look of each method, axes, and panels; and the work–precision figure.
const SHAPES = {s: [4, 45], D: [4, 0], d: [4, 0], p: [5, 0], h: [6, 0], H: [6, 30], 8: [8, 22.5], "^": [3, 0], v: [3, 180], "<": [3, -90], ">": [3, 90]};

function markerPath(marker, size = 4.5) {
  const symbol = (type, area) => d3.symbol().type(type).size(area * size * size)();
  if (marker === "*") return symbol(d3.symbolStar, 2.4);
  if (marker === "P" || marker === "X") return symbol(d3.symbolCross, 2.6);
  const [corners, turn] = SHAPES[marker] ?? [0, 0];
  if (!corners) return symbol(d3.symbolCircle, 2.6);
  const at = k => (turn + 360 * k / corners - 90) * Math.PI / 180;
  return `M${d3.range(corners).map(k => [1.15 * size * Math.cos(at(k)), 1.15 * size * Math.sin(at(k))].map(x => x.toFixed(2))).join("L")}Z`;
}

const lookOf = method => DATA.styles[method] ?? {color: "#7F7F7F", face: "#7F7F7F", marker: "o", dash: ""};

const path = (x, y, points, curve = d3.curveLinear) => d3.line().x(x).y(y).curve(curve)(points);

function drawMarker(place, method, size) {
  const look = lookOf(method);
  return place.append("path").attr("d", markerPath(look.marker, size)).attr("fill", look.face).attr("stroke", look.color)
    .attr("stroke-width", 1.3).attr("class", "marker");
}

function swatch(method) {
  const svg = d3.create("svg").attr("width", 34).attr("height", 14).attr("aria-hidden", "true").attr("class", "swatch");
  const look = lookOf(method);
  svg.append("path").attr("d", "M1,7H33").attr("stroke", look.color).attr("stroke-width", 1.8).attr("stroke-dasharray", look.dash);
  drawMarker(svg.append("g").attr("transform", `translate(17,7)${look.marker === "X" ? "rotate(45)" : ""}`), method);
  return svg.node();
}

// A panel with axes. x, y: scales whose ranges are set here.
function panel(title, x, y, {width = 440, height = 270, xLabel = "", yLabel = "", xTicks, yTicks} = {}) {
  const margin = {top: 26, right: 14, bottom: 42, left: 58};
  x.range([margin.left, width - margin.right]);
  y.range([height - margin.bottom, margin.top]);
  const svg = d3.create("svg").attr("viewBox", `0 0 ${width} ${height}`).attr("role", "img").attr("aria-label", title).attr("class", "panel");
  const axis = (made, ticks) => ticks ? made.tickValues(ticks).tickFormat(tidy) : made.ticks(6);
  svg.append("g").attr("class", "axis").attr("transform", `translate(0,${height - margin.bottom})`)
    .call(axis(d3.axisBottom(x), xTicks).tickSize(-(height - margin.top - margin.bottom)).tickPadding(6));
  svg.append("g").attr("class", "axis").attr("transform", `translate(${margin.left},0)`)
    .call(axis(d3.axisLeft(y), yTicks).tickSize(-(width - margin.left - margin.right)).tickPadding(6));
  svg.append("text").attr("x", margin.left).attr("y", 15).attr("class", "title").text(title);
  svg.append("text").attr("x", (margin.left + width - margin.right) / 2).attr("y", height - 5).attr("text-anchor", "middle").text(xLabel);
  svg.append("text").attr("transform", `translate(13,${(height - margin.bottom + margin.top) / 2})rotate(-90)`).attr("text-anchor", "middle").text(yLabel);
  return svg;
}

// Powers of ten in an interval, at most about `most` of them.
function powers([low, high], most = 7) {
  const first = Math.ceil(Math.log10(low) - 1e-9), last = Math.floor(Math.log10(high) + 1e-9);
  return d3.range(first, last + 1, Math.max(1, Math.ceil((last - first + 1) / most))).map(k => Number(`1e${k}`));
}

function logDomain(values) {
  const [low, high] = d3.extent(values);
  return low === undefined ? [0.1, 10] : [low / 1.6, high * 1.6];
}

// The methods as buttons: one of them can be highlighted in all panels.
function legend(methods, onPick = method => update({solver: STATE.solver === method ? "" : method})) {
  return el("div", {class: "legend", role: "group", "aria-label": "Highlight a solver"}, methods.map(method =>
    el("button", {type: "button", "data-method": method, "aria-pressed": String(STATE.solver === method), onclick: () => onPick(method)},
      swatch(method), method)));
}

const known = cells => DATA.order.map(label => cells.find(cell => cell.label === label)?.method)
  .filter((method, place, all) => method && all.indexOf(method) === place);

const ZERO_ERROR = 1e-16, LARGEST_ERROR = 1, PANELS = 12;
const drawnError = cell => Math.min(Math.max(cell.displacement_error_mm, cell.bound_mm ?? 0, ZERO_ERROR), LARGEST_ERROR);

function precision(main) {
  const cells = filtered().filter(cell => timeOf(cell) > 0 && cell.displacement_error_mm != null);
  const scenes = DATA.scenes.filter(scene => cells.some(cell => cell.scene === scene.scene));
  const methods = known(cells);
  if (!cells.length) return main.append(el("p", {}, "No answer passes the filters."));
  main.append(el("p", {class: "note"}, "Seconds against the error reached; down and to the left is better. A line joins the tolerances of a solver. "
    + "Dashed: the limit. Grey: errors below the reference error bound cannot be told apart."
    + (scenes.length > PANELS ? ` The first ${PANELS} of ${scenes.length} scenes are drawn; the filters choose others.` : "")),
  legend(methods));
  const across = d3.extent([...cells.map(drawnError), Number(STATE.limit)]);
  const grid = el("div", {class: "panels"});
  for (const scene of scenes.slice(0, PANELS)) grid.append(precisionPanel(scene, cells.filter(cell => cell.scene === scene.scene), methods, across));
  main.append(grid);
}

function precisionPanel(scene, cells, methods, across) {
  const x = d3.scaleLog().domain([across[0] / 2, across[1] * 2]), y = d3.scaleLog().domain(logDomain(cells.map(timeOf)));
  const svg = panel(`${scene.scene}: n = ${scene.n}, ${scene.active} of ${scene.m} closed`, x, y,
    {xLabel: "error, mm", yLabel: "seconds", xTicks: powers(x.domain()), yTicks: powers(y.domain(), 5)});
  const [bottom, top] = y.range(), left = x.range()[0];
  const bound = d3.max(cells, cell => cell.bound_mm) ?? 0;
  if (x(bound || 1e-300) > left) svg.append("rect").attr("x", left).attr("y", top).attr("width", x(bound) - left).attr("height", bottom - top).attr("class", "bound");
  const at = x(Math.max(Number(STATE.limit), d3.max(cells, cell => cell.least_mm) ?? 0));
  svg.append("path").attr("d", `M${at},${top}V${bottom}`).attr("class", "limit");
  for (const method of methods) {
    const own = cells.filter(cell => cell.method === method).sort((a, b) => a.tolerance - b.tolerance);
    if (!own.length) continue;
    const faded = STATE.solver && STATE.solver !== method, look = lookOf(method);
    const group = svg.append("g").attr("class", faded ? "faded" : "drawn");
    if (own.length > 2) group.append("path").attr("fill", "none").attr("stroke", look.color).attr("stroke-dasharray", look.dash)
      .attr("stroke-width", STATE.solver === method ? 3 : 1.6).attr("d", path(cell => x(drawnError(cell)), cell => y(timeOf(cell)), own));
    for (const cell of own) {
      const place = group.append("g").attr("transform", `translate(${x(drawnError(cell))},${y(timeOf(cell))})${look.marker === "X" ? "rotate(45)" : ""}`);
      const mark = drawMarker(place, method);
      listen(mark.node(), () => described(cell), () => openRow(cell));
    }
  }
  if (STATE.solver) svg.selectAll("g.drawn").raise();
  return svg.node();
}

function listen(node, lines, pick) {
  node.setAttribute("tabindex", "0");
  node.addEventListener("mousemove", event => tip(lines(), node, event));
  node.addEventListener("focus", () => tip(lines(), node));
  for (const end of ["mouseleave", "blur"]) node.addEventListener(end, noTip);
  if (!pick) return;
  node.addEventListener("click", pick);
  node.addEventListener("keydown", event => event.key === "Enter" && pick());
}
