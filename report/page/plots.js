// Fills the Bokeh figures of a page: work against precision, gap maps, exceedance.
const FIGURES = {}, sourceOf = (figure, name) => figure.renderers.find(each => each.name === name).data_source;

// The figure in an element, drawn when first asked for. picked: what a click on an item of its source changes.
function figureIn(id, item, name, picked) {
  return FIGURES[id] ??= Bokeh.embed.embed_item(item, id).then(({roots}) => {
    const figure = roots[0].model, source = sourceOf(figure, name), {selected} = source;
    selected.connect(selected.properties.indices.change, () => {
      for (const place of selected.indices) update(picked(place, source.data));
    });
    return figure;
  });
}

// The array behind a text that page_file.py packed.
async function unpacked(text) {
  const packed = new Blob([Uint8Array.from(atob(text), letter => letter.charCodeAt(0))]).stream();
  const bytes = new Response(packed.pipeThrough(new DecompressionStream("deflate")));
  return new Float32Array(await bytes.arrayBuffer());
}

const swatch = method => el("span", {style: DATA.styles[method].css}, `${DATA.styles[method].sign} `);

// A panel per scene.
async function precision() {
  const cells = filtered().filter(cell => cell.seconds > 0 && cell.reached_mm != null);
  const groups = DATA.scenes.map(({heading, scene}) => [heading, cells.filter(cell => cell.scene === scene)])
    .filter(([, own]) => own.length);
  for (const [k, item] of DATA.figures.panels.entries()) {
    const title = document.getElementById(`title${k}`), [heading, own] = groups[k] ?? [];
    title.parentNode.hidden = !own;
    if (!own) continue;
    title.textContent = heading;
    fillPanel(await figureIn(`panel${k}`, item, "cells", (place, {key}) => ({row: key[place]})), own);
  }
}

// A line joins the tolerances of a solver; dashed is the limit, grey what the reference error bound leaves open.
function fillPanel(figure, cells) {
  const column = (list, name) => list.map(cell => cell[name] ?? DATA.styles[cell.method][name]);
  const columns = (list, ...names) => Object.fromEntries(names.map(name => [name, column(list, name)]));
  const lines = [...Map.groupBy(cells, cell => cell.method).values()]
    .map(own => own.toSorted((a, b) => a.tolerance - b.tolerance));
  sourceOf(figure, "cells").data = {about: cells.map(described),
    ...columns(cells, "reached_mm", "seconds", "key", "color", "face", "marker", "angle", "alpha")};
  const [reached_mm, seconds] = ["reached_mm", "seconds"].map(name => lines.map(own => column(own, name)));
  sourceOf(figure, "lines").data = {reached_mm, seconds, ...columns(lines.map(([first]) => first), "color", "dash", "alpha")};
  figure.center.find(mark => mark.name === "limit").location = Math.max(...column(cells, "limit_mm"));
  figure.center.find(mark => mark.name === "bound").right = Math.max(...column(cells, "bound_mm"));
}

// The corners of each cell, of `counts` many.
function split(corners, counts) {
  let start = 0;
  return Array.from(counts, count => corners.slice(start, start += count));
}

// The largest value at each place: contacts of two pairs may lie above one another.
function largestAt({x, y}, values) {
  const largest = new Map(), place = k => `${x[k]} ${y[k]}`;
  values.forEach((value, k) => largest.set(place(k), Math.max(value, largest.get(place(k)) ?? -Infinity)));
  return values.map((_, k) => largest.get(place(k)));
}

let drawing = 0;

async function gapMap() {
  const turn = ++drawing, map = DATA.maps.maps[at("map")], {fields} = map;
  const name = fields[at("field")] ? at("field") : Object.keys(fields)[0], field = fields[name];
  const packed = {...DATA.maps.groups[map.group], value: field.values};
  for (const other in fields) if (fields[other].hover) packed[other] = fields[other].values;
  const figure = await figureIn("map", DATA.figures.map, "above", node => map.exceeded ? {node} : {});
  const columns = Object.fromEntries(await Promise.all(
    Object.entries(packed).map(async ([column, text]) => [column, await unpacked(text)])));
  if (turn !== drawing) return; // another map is asked for by now
  for (const name of ["xs", "ys"]) columns[name] = split(columns[name], columns.corners);
  columns.value = largestAt(columns, columns.value);
  const above = at("threshold") === "" ? field.limit ?? Infinity : Number(at("threshold"));
  const fail = getComputedStyle(document.documentElement).getPropertyValue("--fail");
  const edge = Array.from(columns.value, value => value > above ? fail : "#00000000");
  const room = document.body.clientWidth - 40 - map.beside.width, scale = Math.min(1, room / map.frame.width);
  for (const side of ["width", "height"]) figure[side] = map.beside[side] + Math.round(scale * map.frame[side]);
  Object.assign(figure.x_range, map.x_range);
  Object.assign(figure.y_range, map.y_range);
  sourceOf(figure, "above").data = {...columns, edge};
  sourceOf(figure, "marks").data = map.marks;
  document.getElementById("about-map").textContent = `${map.name}: ${name}, ${field.unit}, at ${map.about}`
    + (above < Infinity ? ` Outlined: above ${above} ${field.unit}.` : "");
  colour(figure, field);
  if (map.exceeded && at("node")) exceedance(map, at("node"), columns);
}

// Shows the renderer and the bar of the field's kind and scale, from and to the values asked for.
function colour(figure, field) {
  const shown = `${field.kind} ${at("scale")}`, end = name => at(name) === "" ? field[name] : Number(at(name));
  const high = end("high"), low = at("scale") === "log" && end("low") <= 0 ? high / 1e4 : end("low");
  for (const bar of figure.right.filter(each => each.color_mapper)) {
    bar.visible = bar.name === shown;
    figure.renderers.find(each => each.name === bar.name).visible = bar.visible;
    if (bar.visible) Object.assign(bar.color_mapper, {low, high});
  }
}

// The curve of a contact, of those at its place the largest, beside those of all.
async function exceedance(map, node, {x, y}) {
  const figure = await FIGURES.curves, gaps = await unpacked(map.exceeded), {shares} = map;
  const above = shares.map((_, s) => largestAt({x, y}, x.map((_, k) => gaps[k * shares.length + s]))[node]);
  sourceOf(figure, "contact").data = {x: above, y: shares};
  const place = `x = ${number(x[node], 5)}, y = ${number(y[node], 5)} mm`;
  document.getElementById("about-map").append(` Chosen: ${place}.`);
}
