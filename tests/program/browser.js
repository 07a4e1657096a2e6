// Asks the page in the frame what is wrong with it, and writes the answer into the page around it.
addEventListener("load", () => {
  const frame = document.getElementById("page"), page = frame.contentDocument, wrong = [];
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
    overlaps([...page.querySelectorAll("h1, h2, h3, p, button, summary, li, th, td, .scroll")], state);
  };
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
  const pictures = [...page.querySelectorAll("svg[role=img]")];
  for (const own of pictures) if (!own.querySelector("title")) wrong.push("a picture without a title");
  document.getElementById("found").textContent = JSON.stringify({
    wrong, unfolding: details.length, pictures: pictures.length, done: page.querySelectorAll(".bar.done").length,
    now: [...page.querySelectorAll(".bar.now")].map(own => own.dataset.step), status: page.getElementById("status")?.textContent,
  });
});
