// What changed between two runs, measurement by measurement.
function compareView(main) {
  const pairs = DATA.comparisons, columns = DATA.columns;
  for (const pair of pairs) {
    const lines = pair.lines.filter(line => (!STATE.change || line.group === STATE.change)
      && (!STATE.search || line.measurement.toLowerCase().includes(STATE.search.toLowerCase())));
    const name = columns.find(([column]) => column === STATE.sort)?.[0];
    if (name) lines.sort((a, b) => (STATE.down ? -1 : 1) * d3.ascending(a[name] ?? Infinity, b[name] ?? Infinity));
    main.append(el("h2", {}, `${pair.old} → ${pair.new}`), el("p", {}, pair.summary),
      el("div", {class: "scroll"}, el("table", {class: "matrix"},
        el("thead", {}, el("tr", {}, columns.map(([column, text, right]) => el("th", {scope: "col", class: right ? "number" : "", "aria-sort": name === column ? (STATE.down ? "descending" : "ascending") : "none"},
          el("button", {type: "button", "data-sort": column, onclick: () => update({sort: column, down: STATE.sort === column && !STATE.down ? "1" : ""})},
            text, name === column ? (STATE.down ? " ▾" : " ▴") : ""))))),
        el("tbody", {}, lines.map(line => el("tr", {class: `change-${line.group.split(" ")[0]}`}, columns.map(([column, , right]) =>
          el("td", {class: right ? "number" : ""}, typeof line[column] === "number" ? number(line[column]) : String(line[column] ?? "–")))))))),
      el("p", {}, `${lines.length} of ${pair.lines.length} measurements. `, el("button", {type: "button", onclick: () =>
        download("comparison.csv", [columns.map(([column]) => column), ...lines.map(line => columns.map(([column]) => line[column]))])}, "CSV of what is shown")));
  }
}

function compareControls() {
  const groups = [...new Set(DATA.comparisons.flatMap(pair => pair.lines.map(line => line.group)))];
  return [el("label", {}, "change ", el("select", {id: "change", onchange: event => update({change: event.target.value})},
    el("option", {value: ""}, "all"), groups.map(name => el("option", {value: name, selected: STATE.change === name}, name)))),
  el("label", {}, "measurement ", el("input", {id: "search", type: "search", value: STATE.search, onchange: event => update({search: event.target.value})}))];
}
