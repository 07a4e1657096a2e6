// Shows the lines of /events as tables, and the picture of the plan, which the program draws (/plan). Strings from lines become text
// nodes, never markup.
"use strict";

const SHOWN = 500; // maximum number of rows in the table of events and answers
const QUIET = new Set(["handled", "ready", "planning", "plan_kept"]);
const BAD = new Set(["error", "plan_none", "contradicted", "unconcluded", "unrecorded", "suspend_action", "cancel_action"]);
const $ = (id) => document.getElementById(id);
let state;
let drawing = false, again = false;

function element(name, text, attributes = {}) {
  const made = document.createElement(name);
  if (text !== undefined && text !== null) made.textContent = String(text);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

function row(cells, attributes = {}) {
  const made = element("tr", undefined, attributes);
  for (const cell of cells) {
    if (cell instanceof Node) made.append(cell);
    else made.append(element("td", cell, typeof cell === "number" ? { class: "number" } : {}));
  }
  return made;
}

const pairs = (object) => Object.entries(object ?? {}).map(([key, value]) => `${key}: ${value}`).join(", ");
const reasons = (list) => (list ?? []).join("; ");

// Returns the arguments of a step without functions and designs, which are shown as its configuration.
function context(step) {
  const known = new Set(Object.entries(step.configuration ?? {}).flat());
  return (step.arguments ?? []).filter((word) => !known.has(word)).join(" ");
}

// Returns the headline and its style. Both depend on `state`, not on the last message alone, so that nothing outdated is shown.
function headline() {
  const { action, suspended, planning } = state;
  if (state.lost) return ["The connection is lost; what was last seen stays here", "stuck"];
  if (state.reached) return ["The goal is reached", "works"];
  if (planning !== undefined) return [`Planning for ${planning} s`, "works"];
  if (state.plan === "none") return ["There is no plan", "stuck"];
  if (suspended !== undefined) return [`Action ${suspended.action} is suspended: ${suspended.because}`, "stuck"];
  if (action) return [action, "works"];
  return [state.plan === "found" ? "There is a plan" : "Connected", "works"];
}

function showState() {
  const [text, kind] = headline();
  $("plan-about").textContent = state.plan === "none" ? `There is no plan: ${state.why}` : state.found ?? "There is no plan yet.";
  $("status").textContent = state.ended ? `${text} (the run has ended)` : text;
  $("status").dataset.state = kind;
}

function reset() {
  state = { requested: 0, reached: false, plan: "unknown", configuration: new Map(), designs: new Map() };
  for (const id of ["configuration", "lines"]) $(id).tBodies[0].replaceChildren();
  for (const id of ["plan", "designs"]) $(id).replaceChildren();
  showState();
}

// Marks completed steps as `done` and the current step as `now` in every drawing of the plan.
function markSteps() {
  const now = state.reached ? Infinity : state.requested - Number($("drawn")?.dataset.first) + 1;
  for (const own of $("plan").querySelectorAll("[data-step]")) {
    const steps = own.dataset.step.split(" ").map(Number);
    own.classList.toggle("now", steps.includes(now));
    own.classList.toggle("done", steps.every((step) => step < now));
  }
  // Each picture exists in several widths, only one of which is visible. Its pane is scrolled to the current step.
  const bar = [...$("plan").querySelectorAll(".bar.now")].find((own) => own.getClientRects().length > 0);
  const pane = bar?.closest(".scroll");
  if (pane) pane.scrollLeft += bar.getBoundingClientRect().left - pane.getBoundingClientRect().left - pane.clientWidth / 3;
}

async function drawPlan() {
  again = drawing;
  if (drawing) return;
  drawing = true;
  try {
    const answer = await fetch("/plan");
    const drawn = new DOMParser().parseFromString(answer.ok ? await answer.text() : "", "text/html");
    const open = [...$("plan").querySelectorAll("details")].map((own) => own.open);
    $("plan").replaceChildren(...drawn.body.childNodes);
    $("plan").querySelectorAll("details").forEach((own, index) => { own.open = open[index] ?? false; });
    markSteps();
  } catch {
    // The headline reports a lost connection.
  }
  drawing = false;
  if (again) drawPlan();
}

function showConfiguration() {
  const rows = [...state.configuration].sort().map(([name, design]) => row([element("th", name, { scope: "row" }), design]));
  $("configuration").tBodies[0].replaceChildren(...rows);
}

function showDesigns() {
  const items = [...state.designs].sort().map(([name, { text, because }]) => {
    const item = element("li");
    if (because.length === 0) {
      item.textContent = `${name} ${text}`;
      return item;
    }
    const details = element("details");
    details.append(element("summary", `${name} ${text}`), element("p", reasons(because)));
    item.append(details);
    return item;
  });
  $("designs").replaceChildren(...items);
  $("designs-about").hidden = items.length > 0;
}

function know(designs) {
  for (const own of designs) state.designs.set(own.design, { text: own.available ? "is available" : "is not available", because: own.because });
}

// Text of an answer in the last column of the table, by the kind of the answer.
const WORDS = {
  inferred: (it) => [
    ...it.designs.map((own) => `${own.design} is ${own.available ? "available" : "not available"}`),
    ...it.objectives.map((own) => `${own.objective}: ${own.statuses.join(", ") || "no error"}`),
  ].join("; "),
  plan_requested: (it) => reasons(it.because),
  plan_found: (it) => `${it.steps.length} steps, cost ${it.cost}${it.optimal ? ", proved optimal" : ""}`,
  plan_kept: (it) => it.because,
  plan_none: (it) => `${it.status}: ${it.because}`,
  planning: (it) => `for ${it.seconds} s; cost ${it.cost ?? "not known"}, at least ${it.lower_bound ?? "not known"}`,
  reconfigure: (it) => `${it.function}: ${it.from ?? "nothing"} → ${it.to ?? "nothing"}`,
  unserved: (it) => `${it.objective}: ${reasons(it.because)}`,
  request_action: (it) => `${it.action}: ${it.name} ${context(it)} (${pairs(it.configuration)})`,
  cancel_action: (it) => `${it.action}: ${it.because}`,
  suspend_action: (it) => `${it.action}: ${it.because}`,
  resume_action: (it) => `${it.action}`,
  error: (it) => `${it.code}: ${it.message}`,
  unconcluded: (it) => it.message ?? "the conclusions are known again",
  unrecorded: (it) => it.message,
  contradicted: (it) => it.contradictions.map((own) => own.violated).join("; ") || "consistent again",
};

// Changes of `state` and of the page by an answer, by the kind of the answer.
const CHANGES = {
  ready: (it) => ($("mission").textContent = it.mission ?? ""),
  planning: (it) => (state.planning = it.seconds),
  plan_found(it) {
    const found = `Cost ${it.cost}${it.optimal ? ", proved optimal" : ", not proved optimal"}.`;
    Object.assign(state, { reached: false, plan: "found", found });
  },
  plan_kept: () => (state.plan = "found"),
  plan_none: (it) => Object.assign(state, { reached: false, plan: "none", why: it.because }),
  request_action(it) {
    Object.assign(state, { requested: it.action, reached: false, plan: "found", suspended: undefined });
    state.action = `Action ${it.action}: ${it.name} ${context(it)}`;
    markSteps();
  },
  suspend_action: (it) => (state.suspended = { action: it.action, because: it.because }),
  resume_action: () => (state.suspended = undefined),
  cancel_action: (it) => Object.assign(state, { suspended: undefined, action: `Action ${it.action} is being cancelled: ${it.because}` }),
  goal_reached() {
    Object.assign(state, { reached: true, plan: "found", suspended: undefined });
    markSteps();
  },
  reconfigure(it) {
    state.configuration.set(it.function, it.to ?? "nothing");
    showConfiguration();
  },
  inferred(it) {
    know(it.designs);
    for (const own of it.objectives) state.designs.set(own.objective, { text: own.statuses.join(", ") || "has no error", because: own.because });
    showDesigns();
  },
};

function show(at, line, kind, text) {
  const sort = BAD.has(kind) ? "bad" : kind === "event" ? "event" : "effect";
  const body = $("lines").tBodies[0];
  body.prepend(row([`${at.toFixed(3)} s`, line ?? "", kind, text], { class: sort }));
  while (body.rows.length > SHOWN) body.lastElementChild.remove();
}

function take(message) {
  const news = JSON.parse(message.data);
  if (news.left_out) return show(news.at, undefined, "left out", `${news.left_out} lines that came too fast`);
  if (news.heard !== undefined) return show(news.at, news.line, "event", news.heard);
  if (news.known) return know(news.known), showDesigns();
  if (news.planned) {
    state.requested = Math.max(state.requested, news.planned.under_way ?? 0);
    // If a run is resumed from a journal, no answer reports the plan that exists already.
    if (news.planned.exists) state.plan = "found";
    showState();
    return drawPlan();
  }
  const said = news.said;
  // If the search goes on, the next `planning` shows its time again.
  state.planning = undefined;
  CHANGES[said.answer]?.(said);
  showState();
  if (!QUIET.has(said.answer)) show(news.at, said.line, said.answer, WORDS[said.answer]?.(said) ?? "");
}

reset();
const source = new EventSource("/events");
source.addEventListener("begin", () => reset());
source.addEventListener("message", take);
source.addEventListener("error", () => ((state.lost = true), showState()));
source.addEventListener("end", () => {
  source.close();
  state.ended = true;
  showState();
});
