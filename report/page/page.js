// The banner, the views and their controls.
const VIEWS = {
  run: {...((DATA.scenes ?? []).some(scene => scene.ladder) ? {ladders: ["Ladders", ladderView]} : {}), matrix: ["Matrix", matrix], precision: ["Work and precision", precision], solver: ["One solver", solverView], maps: ["Gap maps", mapView]},
  answer: {maps: ["Gap maps", mapView], answer: ["Answer", answerView]},
  series: {maps: ["Gap maps", mapView], curves: ["Exceedance", curveView]},
  compare: {compare: ["Comparison", compareView]},
}[DATA.kind];
const JUDGED = ["ladders", "matrix", "precision", "solver"];

function banner() {
  const facts = DATA.banner, box = document.getElementById("banner"), warned = facts.warnings.length > 0;
  box.className = warned ? "warned" : "";
  const answer = DATA.headline;
  if (answer) {
    const fasteners = DATA.fasteners ?? [];
    box.before(el("section", {id: "headline", class: answer.kind}, el("p", {}, answer.text),
      fasteners.length ? el("details", {open: fasteners.length <= 12}, el("summary", {}, `forces of ${fasteners.length} fasteners`),
        tableOf(["kind", "contact", "x, mm", "y, mm", "force, N"].map((text, k) => [text, line => k > 1 ? number(line[k], 5) : words(line[k]), k > 1]), fasteners, {name: ""})) : ""));
    if (!warned) document.getElementById("view").after(box); // first the answer, last the machine
  }
  box.replaceChildren(
    el("p", {}, el("b", {}, facts.machines.join(" / ")), facts.counts ? ` · ${facts.counts}` : "", facts.measured ? ` · measured ${facts.measured}` : "",
      facts.commits ? ` · commit ${facts.commits}` : ""),
    warned ? el("ul", {}, facts.warnings.map(text => el("li", {}, `⚠ ${text}`))) : "",
    facts.versions.length ? el("details", {}, el("summary", {}, "versions of the solvers"), el("p", {}, facts.versions.join("; "))) : "");
}

const current = () => VIEWS[STATE.view] ? STATE.view : Object.keys(VIEWS)[0];

function options(name, label, list, none = "all") {
  return el("label", {}, `${label} `, el("select", {id: name, onchange: event => update({[name]: event.target.value})},
    none ? el("option", {value: ""}, none) : "",
    list.map(([value, text]) => el("option", {value, selected: STATE[name] === value}, text))));
}

function controls() {
  const form = document.getElementById("controls"), focused = document.activeElement?.id;
  form.hidden = false;
  if (JUDGED.includes(current())) form.replaceChildren(...judgedControls());
  else if (current() === "compare") form.replaceChildren(...compareControls());
  else { form.replaceChildren(); form.hidden = true; }
  document.getElementById(focused)?.focus({preventScroll: true});
}

function judgedControls() {
  const slider = el("input", {id: "limit", type: "range", min: "3", max: "12", step: "0.5", value: String(-Math.log10(Number(STATE.limit))),
    "aria-valuetext": `${tidy(Number(STATE.limit))} mm`,
    oninput: event => update({limit: String(Number((10 ** -event.target.value).toPrecision(2)))})});
  const usable = Object.entries(METRICS).filter(([name]) => name === "error" || CELLS.some(cell => cell[name] != null));
  const filters = Object.entries(FILTERS).map(([name, [label, list]]) => [name, label, list()]).filter(([name, , list]) => list.length > 1 || STATE[name]);
  return [
    el("div", {class: "limit"}, el("label", {for: "limit"}, "limit"), el("span", {class: "end"}, "1e-3"), slider, el("span", {class: "end"}, "1e-12"),
      el("output", {for: "limit", id: "limit-text"}, `${tidy(Number(STATE.limit))} mm`)),
    options("metric", "show", usable, ""),
    options("rows", "lines", [["best", "best tolerance only"], ["all", "every tolerance"]], ""),
    ...filters.map(([name, label, list]) => options(name, label, list, name === "machine" ? "" : "all")),
    el("button", {type: "button", id: "reset", onclick: () => update({...DEFAULTS, view: STATE.view})}, "reset"),
  ];
}

function show() {
  noTip();
  const name = current(), main = document.getElementById("view"), at = document.activeElement, sort = at?.dataset?.sort, pin = at?.dataset?.pin, method = at?.dataset?.method;
  const box = main.querySelector(".scroll"), scrolled = box ? [box.scrollLeft, box.scrollTop] : [0, 0];
  document.getElementById("views").replaceChildren(...Object.entries(VIEWS).filter(([view]) => view !== "maps" || DATA.maps.maps.length).map(([view, [text]]) =>
    el("button", {type: "button", "aria-current": view === name ? "page" : null, "data-view": view, onclick: () => update({view})}, text)));
  controls();
  main.replaceChildren();
  VIEWS[name][1](main);
  main.querySelector(".scroll")?.scrollTo(...scrolled);
  const again = [["sort", sort], ["pin", pin], ["method", method]].find(([, value]) => value);
  if (again) [...document.querySelectorAll(`[data-${again[0]}]`)].find(node => node.dataset[again[0]] === again[1])?.focus({preventScroll: true});
  const counts = document.getElementById("counts");
  counts.textContent = "";
  if (JUDGED.includes(name)) {
    const cells = filtered(), within = cells.filter(cell => verdict(cell, Number(STATE.limit)) === "within").length;
    counts.textContent = `${within} of ${cells.length} measurements shown are within ${tidy(Number(STATE.limit))} mm.`;
  }
}

// The row that the address names.
function openNamed() {
  const cell = STATE.row && CELLS.find(each => each.key === STATE.row);
  if (cell) openRow(cell);
}

document.getElementById("controls").addEventListener("submit", event => event.preventDefault());
document.getElementById("row").addEventListener("close", () => remember({row: ""}));
addEventListener("hashchange", () => { document.getElementById("row").close(); readAddress(); show(); openNamed(); });
addEventListener("keydown", event => event.key === "Escape" && noTip());
readAddress();
banner();
show();
openNamed();
