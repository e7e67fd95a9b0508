// What changed between two runs, measurement by measurement.
function compareView(main) {
  const columns = DATA.columns, text = value => typeof value === "number" ? number(value) : String(value ?? "–");
  for (const pair of DATA.comparisons) {
    const lines = pair.lines.filter(line => (!STATE.change || line.group === STATE.change)
      && (!STATE.search || line.measurement.toLowerCase().includes(STATE.search.toLowerCase())));
    const name = columns.find(([column]) => column === STATE.sort)?.[0];
    if (name) lines.sort((a, b) => (STATE.down ? -1 : 1) * d3.ascending(a[name] ?? Infinity, b[name] ?? Infinity));
    const shown = columns.map(([column, heading, right]) => {
      const [button, more] = sorting(column, heading, {kind: right ? "number" : ""});
      return [button, line => text(line[column]), right, more];
    });
    main.append(el("h2", {}, `${pair.old} → ${pair.new}`), el("p", {}, pair.summary),
      el("div", {class: "scroll"}, tableOf(shown, lines, {row: line => ({class: `change-${line.group.split(" ")[0]}`})})),
      el("p", {}, `${lines.length} of ${pair.lines.length} measurements. `, el("button", {type: "button", onclick: () =>
        download("comparison.csv", [columns.map(([column]) => column), ...lines.map(line => columns.map(([column]) => line[column]))])}, "CSV of what is shown")));
  }
}

function compareControls() {
  const groups = [...new Set(DATA.comparisons.flatMap(pair => pair.lines.map(line => line.group)))];
  return [options("change", "change", groups.map(name => [name, name])),
    el("label", {}, "measurement ", el("input", {id: "search", type: "search", value: STATE.search, onchange: event => update({search: event.target.value})}))];
}
