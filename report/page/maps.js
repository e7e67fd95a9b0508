// Gap maps on a canvas, with a range, a scale, a threshold contour, and the curve of a contact; exceedance of a series.
const SCALES = {linear: "linear", log: "logarithmic"};
const SIGNED = t => d3.interpolateRdBu(1 - t); // red: larger than before
const FILLED = {gap: d3.interpolateViridis, force: t => d3.interpolateMagma(1 - t)};
const MEMORY = new Map();
let drawing = 0;

function array(text) {
  if (!MEMORY.has(text)) MEMORY.set(text, unpacked(text));
  return MEMORY.get(text);
}

async function mapView(main) {
  const {maps, groups, left_out: leftOut} = DATA.maps, map = maps[Number(STATE.map)] ?? maps[0];
  if (!map) return main.append(el("p", {}, "No contact has a place on a map."));
  const cases = map.fields.filter(field => field.case != null), others = map.fields.filter(field => field.case == null);
  const field = map.fields.find(each => each.name === STATE.field) ?? map.fields.find(each => ["gap after", "95 % quantile"].includes(each.name)) ?? map.fields[0];
  const slider = el("input", {id: "case", type: "range", min: "0", max: String(cases.length - 1), value: String(Math.max(0, cases.indexOf(field))),
    "aria-valuetext": field.name, oninput: event => update({field: cases[event.target.value].name})});
  const entry = (name, label) => el("label", {}, `${label} `, el("input", {id: name, type: "number", step: "any", value: STATE[name],
    onchange: event => update({[name]: event.target.value})}));
  const controls = el("div", {class: "controls"},
    maps.length > 1 ? options("map", "map", maps.map((each, k) => [String(k), each.name]), "") : "",
    options("field", "show", others.map(each => [each.name, each.name]), field.case == null ? "" : field.name),
    cases.length ? el("label", {}, `case (${cases.length} of them) `, slider) : "",
    map.worst == null ? "" : el("button", {type: "button", id: "worst", onclick: () => update({field: `case ${map.worst}`})}, `worst case: ${map.worst}`),
    options("scale", "scale", Object.entries(SCALES), ""), entry("low", `from, ${field.unit}`), entry("high", `to, ${field.unit}`), entry("threshold", `contour at, ${field.unit}`));
  const place = el("div", {class: "map"}), about = el("p", {class: "note", id: "about-map"});
  main.append(controls, about, place);
  controls.querySelector("#field").value = field.case == null ? field.name : "";
  const turn = ++drawing;
  const [nodes, ...values] = await Promise.all([array(groups[map.group]), ...[field, ...others].map(each => array(each.values))]);
  if (turn !== drawing) return;
  const known = others.map((each, k) => [each, values[k + 1]]);
  drawMap(place, map, field, nodes, values[0], known);
  about.textContent = `${map.name}: ${field.name}, ${field.unit}. ${number(d3.min(values[0]))} to ${number(d3.max(values[0]))} ${field.unit} at ${map.contacts} contacts`
    + (map.every > 1 ? `, every ${map.every}th of which is drawn` : "") + (!map.marks.length ? "." : DATA.kind === "answer" ? ". Circles: fasteners and clamps." : ". Circles: fasteners.")
    + (map.exceeded ? " A click on a contact shows how often its gap is exceeded." : "")
    + (leftOut.length ? ` Left out, too large or damaged: ${leftOut.join(", ")}.` : "");
  if (map.exceeded && STATE.node) main.append(await exceedance(map, Number(STATE.node), nodes));
}

function colours(field, values) {
  if (field.signed) {
    const most = Number(STATE.high) || d3.max(values, Math.abs) || 1, scale = d3.scaleLinear().domain([-most, most]).range([0, 1]).clamp(true);
    return {scale, log: false, ends: [-most, most], of: value => SIGNED(scale(value))};
  }
  const log = STATE.scale === "log", positive = values.filter(value => value > 0);
  const ends = [STATE.low === "" ? (log ? Math.max(d3.quantile(positive.sort(), 0.02) ?? 1e-9, 1e-12) : Math.min(0, d3.min(values))) : Number(STATE.low),
    STATE.high === "" ? d3.max(values) || 1 : Number(STATE.high)];
  if (log && ends[0] <= 0) ends[0] = ends[1] / 1e6;
  const scale = (log ? d3.scaleLog() : d3.scaleLinear()).domain(ends).range([0, 1]).clamp(true);
  const filled = field.unit === "N" ? FILLED.force : FILLED.gap;
  return {scale, log, ends, of: value => field.unit === "N" && !(value > 0) ? "#ffffff" : filled(scale(log ? Math.max(value, ends[0]) : value))};
}

// The nodes' x and y, and the size of the cells if they lie on a grid.
function places(nodes) {
  const count = nodes.length / 2, x = i => nodes[2 * i], y = i => nodes[2 * i + 1];
  const steps = pick => [...new Set(d3.range(count).map(i => Math.round(pick(i) * 1e4) / 1e4))].sort(d3.ascending);
  const columns = steps(x), rows = steps(y);
  const edges = list => [list[0], ...d3.pairs(list).map(([a, b]) => (a + b) / 2), list[list.length - 1]];
  const full = columns.length * rows.length === count && columns.length > 1 && rows.length > 1;
  return {count, x, y, columns, rows, full, xe: edges(columns), ye: edges(rows)};
}

function drawMap(box, map, field, nodes, values, known) {
  const on = places(nodes), {columns, rows, xe, ye} = on, colour = colours(field, values);
  const width = Math.max(300, Math.min(box.clientWidth || 900, 1300)), pad = 46;
  const span = [columns[columns.length - 1] - columns[0] || 1, rows[rows.length - 1] - rows[0] || 1];
  const scale = Math.min((width - 2 * pad) / span[0], 560 / span[1]), height = Math.max(40, scale * span[1]);
  const x = d3.scaleLinear().domain([columns[0], columns[columns.length - 1]]).range([pad, pad + scale * span[0]]);
  const y = d3.scaleLinear().domain([rows[0], rows[rows.length - 1]]).range([10 + height, 10]);
  const dense = devicePixelRatio || 1, canvas = el("canvas", {width: width * dense, height: (height + 20) * dense, style: `width:${width}px;height:${height + 20}px`});
  const pen = canvas.getContext("2d"), threshold = STATE.threshold === "" ? null : Number(STATE.threshold);
  const sharp = length => Math.round(length * dense) / dense; // whole pixels leave no seams
  pen.scale(dense, dense);
  const place = new Map(on.full ? d3.range(on.count).map(i => [`${bisect(columns, on.x(i))},${bisect(rows, on.y(i))}`, i]) : []);
  const at = (c, r) => place.get(`${c},${r}`);
  for (let i = 0; i < on.count; i++) {
    pen.fillStyle = colour.of(values[i]);
    if (!on.full) { pen.beginPath(); pen.arc(x(on.x(i)), y(on.y(i)), 2.5, 0, 7); pen.fill(); continue; }
    const c = bisect(columns, on.x(i)), r = bisect(rows, on.y(i));
    const [left, top] = [x(xe[c]), y(ye[r + 1])].map(sharp);
    pen.fillRect(left, top, sharp(x(xe[c + 1])) - left, sharp(y(ye[r])) - top);
  }
  if (threshold !== null) contour(pen, on, values, threshold, x, y, at);
  for (const [mx, my] of map.marks) ring(pen, x(mx), y(my), "#111111", map.marks.length > 60 ? 1 : 3.2);
  if (STATE.node !== "" && Number(STATE.node) < on.count) ring(pen, x(on.x(Number(STATE.node))), y(on.y(Number(STATE.node))), "#000000", 6);
  const svg = d3.create("svg").attr("width", width).attr("height", height + 52).attr("class", "over");
  svg.append("g").attr("class", "axis").attr("transform", `translate(0,${height + 12})`).call(d3.axisBottom(x).ticks(Math.max(1, scale * span[0] / 80)));
  svg.append("g").attr("class", "axis").attr("transform", `translate(${pad - 2},0)`).call(d3.axisLeft(y).ticks(Math.max(2, height / 50)));
  svg.append("text").attr("x", pad + scale * span[0] / 2).attr("y", height + 46).attr("text-anchor", "middle").text("x, mm (up: y, mm)");
  const stage = el("div", {class: "stage", tabindex: "0", role: "img", "aria-label": `${map.name}: ${field.name}`}, canvas, svg.node());
  const lookup = d3.quadtree(d3.range(on.count), i => x(on.x(i)), i => y(on.y(i)));
  const nearest = event => { const frame = stage.getBoundingClientRect(); return lookup.find(event.clientX - frame.left, event.clientY - frame.top, 30); };
  const said = i => [`x ${number(on.x(i), 5)} mm, y ${number(on.y(i), 5)} mm`, `${field.name}: ${number(values[i])} ${field.unit}`,
    ...known.filter(([each]) => each !== field).map(([each, own]) => `${each.name}: ${number(own[i])} ${each.unit}`)];
  stage.addEventListener("mousemove", event => { const i = nearest(event); i == null ? noTip() : tip(said(i), stage, event); });
  stage.addEventListener("mouseleave", noTip);
  if (map.exceeded) stage.addEventListener("click", event => { const i = nearest(event); if (i != null) update({node: String(i)}); });
  stage.addEventListener("keydown", event => walk(event, on, said, stage));
  box.replaceChildren(stage, bar(colour, field));
}

const bisect = (list, value) => Math.max(0, Math.min(list.length - 1, d3.bisectLeft(list, value - 1e-4)));

function ring(pen, x, y, colour, size = 3.2) {
  for (const [width, stroke] of [[3, "#ffffffb0"], [1.4, colour]]) {
    pen.beginPath(); pen.arc(x, y, size, 0, 7); pen.lineWidth = width; pen.strokeStyle = stroke; pen.stroke();
  }
}

// The edges between contacts above the threshold and the rest; rings around those above it without a grid.
function contour(pen, on, values, threshold, x, y, at) {
  const above = (c, r) => { const i = at(c, r); return i !== undefined && values[i] > threshold; };
  if (!on.full) return d3.range(on.count).filter(i => values[i] > threshold).forEach(i => ring(pen, x(on.x(i)), y(on.y(i)), "#E8112D", 3.5));
  pen.beginPath();
  for (let c = 0; c <= on.columns.length; c++) for (let r = 0; r <= on.rows.length; r++) {
    if (r < on.rows.length && above(c, r) !== above(c - 1, r)) { pen.moveTo(x(on.xe[c]), y(on.ye[r])); pen.lineTo(x(on.xe[c]), y(on.ye[r + 1])); }
    if (c < on.columns.length && above(c, r) !== above(c, r - 1)) { pen.moveTo(x(on.xe[c]), y(on.ye[r])); pen.lineTo(x(on.xe[c + 1]), y(on.ye[r])); }
  }
  for (const [width, stroke] of [[3.5, "#ffffff"], [1.6, "#E8112D"]]) { pen.lineWidth = width; pen.strokeStyle = stroke; pen.stroke(); }
}

// The arrow keys walk over the contacts; Enter chooses one.
function walk(event, on, said, stage) {
  const step = {ArrowLeft: -1, ArrowRight: 1, ArrowUp: 10, ArrowDown: -10}[event.key];
  if (event.key === "Enter" && stage.node != null) return update({node: String(stage.node)});
  if (!step) return;
  event.preventDefault();
  stage.node = Math.max(0, Math.min(on.count - 1, (stage.node ?? 0) + step));
  tip(said(stage.node), stage);
}

function bar(colour, field) {
  const svg = d3.create("svg").attr("width", 380).attr("height", 40).attr("aria-hidden", "true"), x = colour.scale.copy().range([10, 330]);
  const low = Math.min(...colour.ends), high = Math.max(...colour.ends);
  const at = t => colour.log ? low * (high / low) ** t : low + (high - low) * t;
  svg.selectAll("rect").data(d3.range(160)).enter().append("rect").attr("x", k => 10 + 2 * k).attr("width", 2.5).attr("height", 12).attr("fill", k => colour.of(at(k / 159)));
  svg.append("g").attr("class", "axis").attr("transform", "translate(0,13)").call(d3.axisBottom(x).tickValues(colour.log ? powers([low, high]) : x.ticks(5)).tickFormat(tidy));
  svg.append("text").attr("x", 332).attr("y", 11).text(` ${field.unit}`);
  return svg.node();
}

// Exceedance curves: of one contact of a series, and of the whole series.
async function exceedance(map, node, nodes) {
  const all = await array(map.exceeded), width = map.shares.length, gaps = all.slice(node * width, (node + 1) * width);
  const points = map.shares.map((share, k) => [gaps[k], 100 * share]).filter(([, share]) => share > 0);
  return el("section", {id: "exceedance"}, curve(`Contact at x = ${number(nodes[2 * node], 5)} mm, y = ${number(nodes[2 * node + 1], 5)} mm`,
    [{name: "cases", points}]));
}

function curveView(main) {
  main.append(el("p", {class: "note"}, "How often a remaining gap exceeds t: the share of the cases, by their largest gap, and the share of all contacts."),
    curve("Exceedance of the remaining gap", DATA.curves));
}

function curve(title, curves) {
  const every = curves.flatMap(each => each.points), high = d3.max(every, ([gap]) => gap) || 1;
  const x = d3.scaleLinear().domain([Math.min(0, d3.min(every, ([gap]) => gap)), high]), y = d3.scaleLog().domain([d3.min(every.filter(p => p[1] > 0), p => p[1]) ?? 1, 110]);
  const svg = panel(title, x, y, {width: 760, height: 320, xLabel: "gap t, mm", yLabel: "share with more than t, %", yTicks: [1e-5, 1e-4, 0.001, 0.01, 0.1, 1, 10, 100].filter(value => value >= y.domain()[0])});
  const colours = ["#0072B2", "#D55E00"], dashes = ["", "7 4"];
  curves.forEach(({name, points}, k) => {
    const shown = points.filter(([, share]) => share > 0);
    svg.append("path").attr("d", path(p => x(p[0]), p => y(p[1]), shown)).attr("fill", "none").attr("stroke", colours[k]).attr("stroke-width", 2).attr("stroke-dasharray", dashes[k]);
    svg.append("text").attr("x", 745).attr("y", 42 + 16 * k).attr("text-anchor", "end").style("fill", colours[k]).text(`${k ? "- - " : "— "}${name}`);
    for (const [gap, share] of shown.filter((_, i) => i % Math.ceil(shown.length / 40) === 0))
      listen(svg.append("circle").attr("cx", x(gap)).attr("cy", y(share)).attr("r", 4).attr("fill", colours[k]).attr("fill-opacity", 0.35).node(),
        () => [name, `${number(share)} % exceed ${number(gap)} mm`]);
  });
  return svg.node();
}

function answerView(main) {
  main.append(factTable(DATA.facts));
}
