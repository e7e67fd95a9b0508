// Shows the view that the form names.
const VIEWS = {ladders: matrix, matrix, precision, solver: oneSolver, maps: gapMap};

function show() {
  const changed = [...new FormData(form)].filter(([name, value]) => value !== START.get(name));
  history.replaceState(null, "", `#${new URLSearchParams(changed)}`);
  for (const part of document.querySelectorAll("[data-views]"))
    part.hidden = !part.dataset.views.split(" ").includes(at("view"));
  VIEWS[at("view")]?.();
  openRow();
}

form.addEventListener("input", show);
form.addEventListener("reset", () => setTimeout(show));
dialog.addEventListener("close", () => at("row") && update({row: ""}));
addEventListener("hashchange", () => location.reload());
if (DATA.figures?.curves) figureIn("curves", DATA.figures.curves, "contact");
show();
