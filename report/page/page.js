// Shows the view that the form names.
const VIEWS = {ladders: matrix, matrix, precision, solver: oneSolver, maps: gapMap};

function show() {
  for (const part of document.querySelectorAll("[data-views]"))
    part.hidden = !part.dataset.views.split(" ").includes(at("view"));
  VIEWS[at("view")]?.();
  openRow();
}

form.addEventListener("input", () => update());
form.addEventListener("reset", () => setTimeout(update));
dialog.addEventListener("close", () => at("row") && update({row: ""}));
addEventListener("hashchange", () => location.reload());
if (DATA.figures?.curves) figureIn("curves", DATA.figures.curves, "contact");
show();
