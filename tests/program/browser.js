// Returns the errors of the page in a frame, and figures about its content.
const inspect = frame => {
  const page = frame.contentDocument, wrong = [];
  const shown = element => element.checkVisibility();
  const name = element => `${element.tagName} ${(element.textContent || "").trim().slice(0, 40)}`;
  const overlaps = (elements, context) => {
    const boxes = elements.filter(shown).map(element => [element, element.getBoundingClientRect()]);
    boxes.sort((a, b) => a[1].top - b[1].top);
    boxes.forEach(([first, a], index) => {
      for (const [second, b] of boxes.slice(index + 1)) {
        // The boxes are sorted by their top edge, so later ones are below as well.
        if (b.top >= a.bottom - 1) break;
        const disjoint = a.right <= b.left + 1 || b.right <= a.left + 1;
        if (!disjoint && !first.contains(second) && !second.contains(first)) wrong.push(`${context}: ${name(first)} | ${name(second)}`);
      }
    });
  };
  const layout = state => {
    const root = page.documentElement;
    if (root.scrollWidth > root.clientWidth) wrong.push(`${state}: ${root.scrollWidth} wide, room for ${root.clientWidth}`);
    for (const svg of page.querySelectorAll("svg")) overlaps([...svg.querySelectorAll("text")], `${state}, in a picture`);
    drawings(state);
    overlaps([...page.querySelectorAll("h1, h2, h3, p, button, summary, li, th, td, .scroll")], state);
  };
  const middle = (element) => {
    const box = element.getBoundingClientRect();
    return [(box.left + box.right) / 2, (box.top + box.bottom) / 2];
  };
  const distance = ([a, b], [c, d]) => Math.hypot(a - c, b - d);
  // Exactly one drawing of each picture is visible and, unless it is marked as long, not clipped.
  // The number of a step in a map is next to the arrow of that step.
  const drawings = state => {
    for (const pane of page.querySelectorAll(".drawn")) {
      if (!shown(pane)) continue;
      const [svg, second] = [...pane.querySelectorAll("svg")].filter(shown), label = pane.dataset.picture;
      if (!svg || second) wrong.push(`${state}: not one drawing of ${label}`);
      else if (pane.scrollWidth > pane.clientWidth && !svg.classList.contains("long")) wrong.push(`${state}: ${label} is cut`);
    }
    for (const svg of [...page.querySelectorAll("svg[role=img]")].filter(shown)) {
      const box = svg.getBoundingClientRect();
      for (const text of svg.querySelectorAll("text")) {
        const textBox = text.getBoundingClientRect();
        if (textBox.left < box.left - 1 || textBox.right > box.right + 1) wrong.push(`${state}: the text is cut: ${name(text)}`);
      }
      const legs = [...svg.querySelectorAll(".leg")];
      for (const leg of legs) {
        const text = leg.querySelector("text");
        if (!text) continue;
        const ownDistance = distance(middle(text), middle(leg.querySelector("path")));
        const nearer = legs.find(other => other !== leg && distance(middle(text), middle(other.querySelector("path"))) <= ownDistance);
        if (nearer) wrong.push(`${state}: ${text.textContent} stands at the arrow of step ${nearer.dataset.step}`);
      }
    }
    const table = page.getElementById("lines")?.closest(".scroll");
    if (table && table.scrollWidth > table.clientWidth) wrong.push(`${state}: the table of events is cut`);
  };
  // Labels of the time axes with their positions. Two plans shown next to each other must have equal axes.
  const axes = plan => [...page.querySelectorAll(`.pair [data-plan=${plan}] [data-picture$=timeline] svg`)].filter(shown).map(svg =>
    [...svg.querySelectorAll(".axis text[text-anchor=middle]")].map(label => `${label.textContent} ${Math.round(middle(label)[0] - svg.getBoundingClientRect().left)}`));
  const details = [...page.querySelectorAll("details")];
  if (details.some(part => part.open)) wrong.push("something is unfolded before anybody has asked");
  layout("folded");
  for (const part of details) {
    const summary = part.querySelector("summary");
    if (!shown(summary)) continue;
    summary.focus();
    if (page.activeElement !== summary) wrong.push(`no keyboard gets to ${name(summary)}`);
    summary.click();
    if (!part.open) wrong.push(`does not unfold: ${name(summary)}`);
  }
  if (page.getElementById("fold")) {
    page.getElementById("fold").click();
    if (details.some(part => part.open)) wrong.push("not all is folded");
    page.getElementById("unfold").click();
    if (details.some(part => !part.open)) wrong.push("not all is unfolded");
  }
  layout("unfolded");
  const [before, after] = [axes("before"), axes("after")];
  if (before.length && after.length && JSON.stringify(before) !== JSON.stringify(after)) wrong.push(`two axes: ${before} | ${after}`);
  const pictures = [...page.querySelectorAll("svg[role=img]")].filter(shown);
  for (const picture of pictures) if (!picture.querySelector("title")) wrong.push("a picture without a title");
  return {
    wrong, unfolding: details.length, pictures: pictures.length, done: [...page.querySelectorAll(".bar.done")].filter(shown).length,
    axis: after[0], about: page.getElementById("plan-about")?.textContent,
    numbers: [...page.querySelectorAll(".leg text")].filter(shown).map(text => text.textContent),
    now: [...page.querySelectorAll(".bar.now")].filter(shown).map(bar => bar.dataset.step), status: page.getElementById("status")?.textContent,
  };
};
// Writes the results for all frames into the surrounding page.
addEventListener("load", () => {
  document.getElementById("found").textContent = JSON.stringify([...document.querySelectorAll("iframe")].map(inspect));
});
