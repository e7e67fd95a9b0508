// Performance profiles (Dolan and Moré, 2002) at the limit, over the scenes that pass the filters.
const PLANNED = 0.75; // share of the scenes in the plan of a method, for it to be compared

// The times over the fastest by method, on the scenes planned for all the methods compared.
function profiles(cells, limit) {
  const scenes = [...new Set(cells.map(cell => cell.scene))], byMethod = d3.nest().key(cell => cell.method).entries(cells);
  const often = byMethod.filter(({values}) => new Set(values.map(cell => cell.scene)).size >= PLANNED * scenes.length);
  const planned = scenes.filter(scene => often.every(({values}) => values.some(cell => cell.scene === scene)));
  const of = scene => often.map(({key, values}) => {
    const good = values.filter(cell => cell.scene === scene && verdict(cell, limit) === "within" && timeOf(cell) > 0);
    return [key, d3.min(good, timeOf) ?? Infinity];
  });
  const judged = scene => !cells.some(cell => cell.scene === scene && cell.bound_mm > BOUND_SHARE * limitOf(cell, limit));
  const times = planned.filter(judged).map(of).filter(row => row.some(([, time]) => time < Infinity));
  const ratios = new Map(often.map(({key}) => [key, []]));
  for (const row of times) {
    const fastest = d3.min(row, ([, time]) => time);
    for (const [method, time] of row) ratios.get(method).push(time / fastest);
  }
  return {ratios, count: times.length, left: byMethod.filter(each => !often.includes(each)).map(({key}) => key)};
}

function profileView(main) {
  const cells = filtered(), {ratios, count, left} = profiles(cells, Number(STATE.limit));
  if (count < 1 || ratios.size < 2) return main.append(el("p", {}, "A profile needs two solvers planned for the same scenes, and an answer within the limit."));
  const methods = known(cells).filter(method => ratios.has(method));
  const largest = d3.max([...ratios.values()].flat().filter(Number.isFinite));
  const x = d3.scaleLog().domain([0.95, Math.max(2, 1.3 * largest)]), y = d3.scaleLinear().domain([0, 1.02]);
  const ticks = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000].filter(value => value <= x.domain()[1]);
  const svg = panel(`Performance profiles over ${count} scenes`, x, y, {width: 900, height: 400, xLabel: `τ: time over that of the fastest (${words(METRICS[STATE.metric === "error" ? "load_case_s" : STATE.metric])})`,
    yLabel: "share of the scenes", xTicks: ticks.length > 9 ? ticks.filter(value => /^[15]/.test(value)) : ticks});
  for (const method of methods) {
    const met = ratios.get(method).filter(Number.isFinite).sort(d3.ascending), look = lookOf(method);
    const points = [[x.domain()[0], met.filter(value => value <= 1).length / count], ...met.map((value, k) => [value, (k + 1) / count]), [x.domain()[1], met.length / count]];
    const group = svg.append("g").attr("class", STATE.solver && STATE.solver !== method ? "faded" : "drawn");
    group.append("path").attr("d", path(p => x(p[0]), p => y(p[1]), points, d3.curveStepAfter)).attr("fill", "none")
      .attr("stroke", look.color).attr("stroke-dasharray", look.dash).attr("stroke-width", STATE.solver === method ? 3.2 : 1.8);
    met.forEach((value, k) => {
      const place = group.append("g").attr("transform", `translate(${x(value)},${y((k + 1) / count)})${look.marker === "X" ? "rotate(45)" : ""}`);
      listen(drawMarker(place, method, 4).node(), () => [method, `${k + 1} of ${count} scenes in at most ${number(value)} times the fastest time`],
        () => update({solver: STATE.solver === method ? "" : method}));
    });
  }
  main.append(el("p", {class: "note"}, "The share of the scenes that a solver answers within the limit, with the best of its tolerances, in at most τ times the time of the fastest. "
    + "Left end: how often it is the fastest; right end: how many it answers at all. Scenes that the reference cannot judge at this limit, or that nothing answered, do not count."
    + (left.length ? ` Planned for fewer than three quarters of the scenes: ${left.join(", ")}.` : "")),
  legend(methods), svg.node(), profileTable(methods, ratios, count));
}

function profileTable(methods, ratios, count) {
  const within = most => method => String(ratios.get(method).filter(value => value <= most).length);
  return tableOf([["solver (form)", method => el("span", {}, swatch(method), method)], ["fastest", within(1), 1], ["τ ≤ 2", within(2), 1],
    ["τ ≤ 10", within(10), 1], ["within the limit", within(1e300), 1], ["scenes", () => String(count), 1]], methods, {name: ""});
}
