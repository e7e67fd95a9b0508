// The state of the page is its form; what differs from the start stands in the address.
const DATA = JSON.parse(document.getElementById("data").textContent);
const form = document.getElementById("controls"), START = new FormData(form);
const at = name => form.elements[name]?.value ?? "";
for (const [name, value] of new URLSearchParams(location.hash.slice(1)))
  if (form.elements[name]) form.elements[name].value = value;

function update(changes = {}) {
  for (const [name, value] of Object.entries(changes)) form.elements[name].value = value;
  const fields = [...new FormData(form)].filter(([name, value]) => value !== START.get(name));
  history.replaceState(null, "", `#${new URLSearchParams(fields)}`);
  show();
}

// An element; its children are texts or elements, never markup.
function el(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes))
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else node.setAttribute(name, value);
  node.append(...children.flat());
  return node;
}

const compared = (a, b, turn = 1) => (a == null) - (b == null) || turn * ((a > b) - (a < b));
const words = text => String(text).replaceAll("_", " ");

function number(value, digits = 3) {
  const rounded = Number.isInteger(value) ? value : Number(value?.toPrecision(digits) ?? NaN);
  if (Number.isNaN(rounded)) return "–";
  return rounded && Math.abs(rounded) < 1e-3 ? rounded.toExponential() : String(rounded);
}

// A bound rounded upwards to three digits.
function raised(bound) {
  const [digits, power] = (bound ?? NaN).toExponential(2).split("e"), nearest = Number(`${digits}e${power}`);
  return nearest < bound ? Number(`${(Number(digits) + 0.01).toFixed(2)}e${power}`) : nearest;
}

// A table that its headings sort. columns: heading, value of a line, and its cell unless that is the value.
function tableOf(columns, lines, kind = "") {
  const named = k => `${at("view")} ${k}`, turn = at("down") ? -1 : 1;
  const value = columns.find((_, k) => named(k) === at("sort"))?.[1];
  const sorted = value ? lines.toSorted((a, b) => compared(value(a), value(b), turn)) : lines;
  const sort = k => update({sort: named(k), down: named(k) === at("sort") && !at("down") ? "1" : ""});
  const heads = columns.map(([text], k) => el("th", {scope: "col"},
    el("button", {type: "button", onclick: () => sort(k)}, text)));
  const plain = content => el("td", {}, typeof content === "string" ? content : number(content));
  const rows = sorted.map(line => el("tr", {},
    columns.map(([, of, cell]) => cell ? cell(line) : plain(of(line)))));
  return el("table", {class: kind}, el("thead", {}, el("tr", {}, heads)), el("tbody", {}, rows));
}
