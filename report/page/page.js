// Shows the view that the form names.
const VIEWS = {ladders: matrix, matrix, precision, solver: oneSolver, maps: gapMap};

// Keeps the changed fields in the address.
function changed() {
  const fields = [...new FormData(form)].filter(([name, value]) => value !== START.get(name));
  history.replaceState(null, "", `#${new URLSearchParams(fields)}`);
  show();
}

function show() {
  for (const part of document.querySelectorAll("[data-views]"))
    part.hidden = !part.dataset.views.split(" ").includes(at("view"));
  VIEWS[at("view")]?.();
  openRow();
}

form.addEventListener("input", changed);
form.addEventListener("reset", () => setTimeout(changed));
dialog.addEventListener("close", () => at("row") && update({row: ""}));
addEventListener("hashchange", () => location.reload());
if (DATA.figures?.curves) figureIn("curves", DATA.figures.curves, "contact");
show();
