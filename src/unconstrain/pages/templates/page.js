// One key for several pictures: a click hides all artists of its group in them.
document.addEventListener("click", function (event) {
  var button = event.target.closest(".key button");
  if (!button) return;
  var shown = button.getAttribute("aria-pressed") !== "true";
  button.setAttribute("aria-pressed", String(shown));
  button.closest("figure").querySelectorAll("[data-key]").forEach(function (artist) {
    if (artist.dataset.key === button.value) artist.style.display = shown ? "" : "none";
  });
});
