// Formulas by KaTeX; a gallery's replay is loaded when it is asked for.
addEventListener("DOMContentLoaded", () => {
  for (const place of document.querySelectorAll(".tex")) {
    const source = place.textContent;
    katex.render(source, place, { displayMode: place.classList.contains("display"), throwOnError: false });
  }
  for (const button of document.querySelectorAll("button.replay")) {
    button.addEventListener("click", () => {
      const frame = document.createElement("iframe");
      frame.src = button.dataset.page;
      frame.title = button.textContent;
      frame.className = "replay";
      frame.allow = "fullscreen";
      button.replaceWith(frame);
    });
  }
});
