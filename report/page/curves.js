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
