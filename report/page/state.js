// The data, the state of the view (kept in the address), and small tools.
const DATA = JSON.parse(document.getElementById("data").textContent);
const DEFAULTS = {
  view: "", limit: String(DATA.limit ?? 1e-7), metric: (DATA.scenes ?? []).every(scene => scene.ladder) ? "error" : "load_case_s", rows: "best", sort: "rank", down: "",
  base: "", solver: "", machine: "", size: "", contact: "", form: "", threads: "", owner: "", tolerance: "",
  status: "", ladder: "", map: "0", field: "", scale: "linear", low: "", high: "", threshold: "", node: "",
  change: "", search: "", row: "",
};
const STATE = {...DEFAULTS};

function readAddress() {
  const given = new URLSearchParams(location.hash.slice(1));
  for (const name in DEFAULTS) STATE[name] = given.get(name) ?? DEFAULTS[name];
  if (!(Number(STATE.limit) > 0)) STATE.limit = DEFAULTS.limit;
}

// Change the state, the address and what is shown.
function update(changes) {
  remember(changes);
  show();
}

function remember(changes) {
  Object.assign(STATE, changes);
  const kept = Object.entries(STATE).filter(([name, value]) => value !== DEFAULTS[name]);
  const hash = new URLSearchParams(kept).toString();
  history.replaceState(null, "", hash ? `#${hash}` : location.pathname + location.search);
}

// An element with attributes and children; text is never taken for markup.
function el(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name === "cell") node.cell = value;
    else if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (value === true) node.setAttribute(name, "");
    else if (value !== false && value != null) node.setAttribute(name, value);
  }
  node.append(...children.flat().filter(child => child != null && child !== false));
  return node;
}

// A table. columns: heading, text or element of a line, whether a number, attributes of the heading.
function tableOf(columns, lines, {name = "matrix", row = () => ({}), cell = () => ({})} = {}) {
  const kind = isNumber => isNumber ? "number" : "";
  return el("table", {class: name},
    el("thead", {}, el("tr", {}, columns.map(([text, , isNumber, more]) => el("th", {scope: "col", class: kind(isNumber), ...more}, text)))),
    el("tbody", {}, lines.map(line => el("tr", row(line), columns.map(([, text, isNumber], k) => el("td", {class: kind(isNumber), ...cell(line, k)}, text(line)))))));
}

const factTable = facts => el("table", {class: "facts"}, facts.map(([name, value]) => el("tr", {}, el("th", {scope: "row"}, name), el("td", {}, value))));

// A heading that sorts by its column: the way down first if the most come first.
function sorting(name, text, {hint = "", kind = "", mostFirst = false} = {}) {
  const own = STATE.sort === name;
  const turned = () => update({sort: name, down: (own ? !STATE.down : mostFirst) ? "1" : ""});
  return [el("button", {type: "button", title: hint, "data-sort": name}, el("span", {}, text), own ? (STATE.down ? " ▾" : " ▴") : ""),
    {class: kind, "aria-sort": own ? (STATE.down ? "descending" : "ascending") : "none", onclick: turned}];
}

// Rows of objects from columns; texts come as their distinct values and places.
function rowsOf(columns) {
  const names = Object.keys(columns);
  if (!names.length) return [];
  const read = names.map(name => {
    const column = columns[name];
    return Array.isArray(column) ? i => column[i] : i => column.distinct[column.places[i]];
  });
  const first = columns[names[0]];
  const count = (first.places ?? first).length;
  return d3.range(count).map(i => Object.fromEntries(names.map((name, k) => [name, read[k](i)])));
}

// Whole numbers as they are, others with three significant digits, with a power of ten below 0.001 and from 100 000.
function number(value, digits = 3) {
  if (value == null || Number.isNaN(value)) return "–";
  if (Number.isInteger(value) && Math.abs(value) < 1e5) return String(value);
  const size = Math.floor(Math.log10(Math.abs(Number(value.toExponential(digits - 1)))));
  if (size < -3 || size >= 5) return value.toExponential(digits - 1).replace("e+", "e");
  return value.toFixed(Math.max(0, digits - 1 - size));
}

function tidy(value) {
  if (value == null) return "–";
  const [mantissa, exponent] = number(value).split("e");
  return exponent ? `${Number(mantissa)}e${exponent}` : String(Number(mantissa));
}

const words = text => String(text).replaceAll("_", " ");

function download(name, lines) {
  const cell = value => {
    let text = value == null ? "" : String(value);
    if (/^\s*[=+\-@]/.test(text) && Number.isNaN(Number(text))) text = `'${text}`;
    return /[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text;
  };
  const blob = new Blob([lines.map(line => line.map(cell).join(",")).join("\n") + "\n"], {type: "text/csv"});
  const link = el("a", {href: URL.createObjectURL(blob), download: name});
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

// The array behind a text made by packed.py.
async function unpacked(text) {
  const bytes = Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Float32Array(await new Response(stream).arrayBuffer());
}

// A description beside the pointer or the focused element.
function tip(lines, target, event) {
  const box = document.getElementById("tip");
  box.replaceChildren(...lines.map(line => el("div", {}, line)));
  box.hidden = false;
  const place = target.getBoundingClientRect();
  const x = event?.clientX ?? place.left + place.width / 2, y = event?.clientY ?? place.bottom;
  box.style.left = `${Math.max(4, Math.min(x + 14, innerWidth - box.offsetWidth - 8))}px`;
  box.style.top = `${y + 16 + box.offsetHeight < innerHeight ? y + 16 : Math.max(4, y - box.offsetHeight - 12)}px`;
}

function noTip() {
  document.getElementById("tip").hidden = true;
}
