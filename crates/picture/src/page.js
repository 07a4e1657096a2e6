"use strict";
const unfold = open => document.querySelectorAll("details").forEach(own => { own.open = open; });
document.getElementById("unfold").addEventListener("click", () => unfold(true));
document.getElementById("fold").addEventListener("click", () => unfold(false));
addEventListener("beforeprint", () => unfold(true));
// What belongs to a step is shown together, wherever it is drawn.
const mark = (event, on) => {
  const own = event.target.closest("[data-step]"), plan = event.target.closest("[data-plan]");
  if (!own || !plan) return;
  for (const step of own.dataset.step.split(" "))
    plan.querySelectorAll(`[data-step~="${step}"]`).forEach(other => other.classList.toggle("here", on));
};
document.addEventListener("mouseover", event => mark(event, true));
document.addEventListener("mouseout", event => mark(event, false));
// Long pictures over the same axis are scrolled together.
const AXES = "[data-picture*=timeline], [data-picture*=number]";
document.addEventListener("scroll", event => {
  const own = event.target;
  if (!own.matches?.(AXES)) return;
  const all = (own.closest(".pair") ?? own.closest("[data-plan]"))?.querySelectorAll(AXES) ?? [];
  for (const other of all) if (other.scrollLeft !== own.scrollLeft) other.scrollLeft = own.scrollLeft;
}, true);
