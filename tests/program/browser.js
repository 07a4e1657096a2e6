// Returns what is wrong with the page in a frame, and what it shows.
const inspect = frame => {
  const page = frame.contentDocument, wrong = [];
  const shown = own => own.checkVisibility();
  const name = own => `${own.tagName} ${(own.textContent || "").trim().slice(0, 40)}`;
  const overlaps = (all, what) => {
    const boxes = all.filter(shown).map(own => [own, own.getBoundingClientRect()]);
    boxes.sort((a, b) => a[1].top - b[1].top);
    boxes.forEach(([one, a], index) => {
      for (const [other, b] of boxes.slice(index + 1)) {
        if (b.top >= a.bottom - 1) break;
        const apart = a.right <= b.left + 1 || b.right <= a.left + 1;
        if (!apart && !one.contains(other) && !other.contains(one)) wrong.push(`${what}: ${name(one)} | ${name(other)}`);
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
  const middle = (own) => {
    const box = own.getBoundingClientRect();
    return [(box.left + box.right) / 2, (box.top + box.bottom) / 2];
  };
  const apart = ([a, b], [c, d]) => Math.hypot(a - c, b - d);
  // Of each picture one drawing is shown, it is not cut, and the numbers of a map stand at the arrows of their steps.
  const drawings = state => {
    for (const pane of page.querySelectorAll(".drawn")) {
      if (!shown(pane)) continue;
      const [svg, more] = [...pane.querySelectorAll("svg")].filter(shown), label = pane.dataset.picture;
      if (!svg || more) wrong.push(`${state}: not one drawing of ${label}`);
      else if (pane.scrollWidth > pane.clientWidth && !svg.classList.contains("long")) wrong.push(`${state}: ${label} is cut`);
    }
    for (const svg of [...page.querySelectorAll("svg[role=img]")].filter(shown)) {
      const box = svg.getBoundingClientRect();
      for (const text of svg.querySelectorAll("text")) {
        const own = text.getBoundingClientRect();
        if (own.left < box.left - 1 || own.right > box.right + 1) wrong.push(`${state}: the text is cut: ${name(text)}`);
      }
      const legs = [...svg.querySelectorAll(".leg")];
      for (const leg of legs) {
        const text = leg.querySelector("text");
        if (!text) continue;
        const own = apart(middle(text), middle(leg.querySelector("path")));
        const nearer = legs.find(other => other !== leg && apart(middle(text), middle(other.querySelector("path"))) <= own);
        if (nearer) wrong.push(`${state}: ${text.textContent} stands at the arrow of step ${nearer.dataset.step}`);
      }
    }
    const table = page.getElementById("lines")?.closest(".scroll");
    if (table && table.scrollWidth > table.clientWidth) wrong.push(`${state}: the table of events is cut`);
  };
  // The times of two plans beside each other are drawn at the same places of their columns.
  const axes = plan => [...page.querySelectorAll(`.pair [data-plan=${plan}] [data-picture$=timeline] svg`)].filter(shown).map(svg =>
    [...svg.querySelectorAll(".axis text[text-anchor=middle]")].map(own => `${own.textContent} ${Math.round(middle(own)[0] - svg.getBoundingClientRect().left)}`));
  const details = [...page.querySelectorAll("details")];
  if (details.some(own => own.open)) wrong.push("something is unfolded before anybody has asked");
  layout("folded");
  for (const own of details) {
    const summary = own.querySelector("summary");
    if (!shown(summary)) continue;
    summary.focus();
    if (page.activeElement !== summary) wrong.push(`no keyboard gets to ${name(summary)}`);
    summary.click();
    if (!own.open) wrong.push(`does not unfold: ${name(summary)}`);
  }
  if (page.getElementById("fold")) {
    page.getElementById("fold").click();
    if (details.some(own => own.open)) wrong.push("not all is folded");
    page.getElementById("unfold").click();
    if (details.some(own => !own.open)) wrong.push("not all is unfolded");
  }
  layout("unfolded");
  const [before, after] = [axes("before"), axes("after")];
  if (before.length && after.length && JSON.stringify(before) !== JSON.stringify(after)) wrong.push(`two axes: ${before} | ${after}`);
  const pictures = [...page.querySelectorAll("svg[role=img]")].filter(shown);
  for (const own of pictures) if (!own.querySelector("title")) wrong.push("a picture without a title");
  return {
    wrong, unfolding: details.length, pictures: pictures.length, done: [...page.querySelectorAll(".bar.done")].filter(shown).length,
    axis: after[0], about: page.getElementById("plan-about")?.textContent,
    numbers: [...page.querySelectorAll(".leg text")].filter(shown).map(own => own.textContent),
    now: [...page.querySelectorAll(".bar.now")].filter(shown).map(own => own.dataset.step), status: page.getElementById("status")?.textContent,
  };
};
// Writes an answer for each frame into the page around them.
addEventListener("load", () => {
  document.getElementById("found").textContent = JSON.stringify([...document.querySelectorAll("iframe")].map(inspect));
});
