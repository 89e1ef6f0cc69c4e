// The first of two panels is drawn before the second is there to share the row with.
window.addEventListener("load", function () {
  document.querySelectorAll(".js-plotly-plot").forEach(function (plot) { Plotly.Plots.resize(plot); });
});
// One key for several pictures: a click hides all traces of its group in them.
document.addEventListener("click", function (event) {
  var button = event.target.closest(".key button");
  if (!button) return;
  var shown = button.getAttribute("aria-pressed") !== "true";
  button.setAttribute("aria-pressed", String(shown));
  button.closest("figure").querySelectorAll(".js-plotly-plot").forEach(function (graph) {
    var which = [];
    graph.data.forEach(function (trace, index) { if (trace.legendgroup === button.value) which.push(index); });
    if (which.length) Plotly.restyle(graph, { visible: shown }, which);
  });
});
