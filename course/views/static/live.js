// What every live view shares in the browser: a labelled region, the drawing, the same in words,
// a line that says whether it is live, and a confirmation of each frame that was drawn.
//
// A view's own script, which follows this one in the same module, defines
//   const view = { label: "…", start(stage, send) { return { draw(frame) {…} } } }
// `send(message)` goes to the view's `control` in the kernel. Everything is made of elements and
// text: nothing from the kernel is ever read as HTML.

const SVG = "http://www.w3.org/2000/svg";
const DEAD =
  "Not live any more: the kernel of this notebook was restarted or has ended. " +
  "Run the cells above again, then this one (menu Run: Run All Above Selected Cell).";
const BUSY = "The kernel is busy: what you press is carried out when it is free again.";
const BUSY_MS = 1000; // that a control has waited when that is said
const ENDINGS = ["terminating", "restarting", "autorestarting", "dead"]; // of a kernel
const CONFIRM_MS = 200; // between two confirmations: each makes the kernel say "busy" and "idle"
const FOCUSABLE = "a, button, input, select, summary, textarea, [tabindex]";

/** An id that nothing else on the page has: each view is a module of its own, with its own counters. */
function newId() {
  return `rosview-${Math.random().toString(36).slice(2)}`;
}

/** Make an element; `on…` are listeners, other keys attributes, `true` sets an empty one. */
function make(tag, attributes = {}, ...children) {
  return fill(document.createElement(tag), attributes, children);
}

/** The same for SVG. */
function shape(tag, attributes = {}, ...children) {
  return fill(document.createElementNS(SVG, tag), attributes, children);
}

function fill(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) {
      element.setAttribute(name, value);
    }
  }
  element.append(...children);
  return element;
}

/** Give a view a name that no other on the page has ("World 2"): screen readers list them by name. */
function nameApart(root, label) {
  const others = [...document.querySelectorAll(".rosview")].filter((other) => other !== root);
  const taken = new Set(others.map((other) => other.getAttribute("aria-label")));
  let name = label;
  for (let number = 2; taken.has(name); number += 1) name = `${label} ${number}`;
  root.setAttribute("aria-label", name);
}

/** JupyterLab's shortcuts leave a control alone only if the control itself says so. */
function guard(root) {
  for (const element of root.querySelectorAll(FOCUSABLE)) {
    element.setAttribute("data-lm-suppress-shortcuts", "true");
  }
}

function render({ model, el }) {
  let dead = false; // until the kernel says otherwise
  const send = (message) => {
    try {
      model.send(message);
    } catch {
      dead = true; // the connection has been taken down
      say();
    }
  };
  const stage = make("fieldset", { class: "rosview-parts", role: "presentation" });
  const place = make("div", { class: "rosview-stage" }, stage);
  const words = make("pre", { class: "rosview-words", tabindex: "0" });
  const status = make("p", { class: "rosview-status", role: "status" });
  const root = make(
    "section", { class: `rosview rosview-${model.get("kind")}`, "aria-label": view.label },
    place,
    make("details", {}, make("summary", {}, "In words"), words),
    status,
  );
  for (const name of ["keydown", "keypress", "keyup"]) {
    root.addEventListener(name, (event) => event.stopPropagation());
  }
  el.append(root);
  // Where the page cannot reach the kernel beside a cell that runs, a control waits for the cell. A
  // question that follows it is answered when it has been carried out.
  let question = 0;
  let busy = false;
  const control = (message) => {
    send(message);
    if (question) return;
    question = setTimeout(() => {
      busy = true;
      say();
    }, BUSY_MS);
    send({ hello: true });
  };
  const answered = () => {
    clearTimeout(question);
    question = 0;
    busy = false;
    dead = false;
    say();
  };
  const drawing = view.start(stage, control);

  let waiting = 0;
  let named = false;
  let confirmed = -CONFIRM_MS;
  const draw = () => {
    waiting = 0;
    if (!named && root.isConnected) { // not before: who is to be told apart is on the page then
      named = true;
      nameApart(root, view.label);
    }
    // None yet, if the first look failed or was too large to send: the status line says why.
    const frame = model.get("frame");
    if (Object.keys(frame).length) drawing.draw({ ...model.get("fixed"), ...model.get("slow"), ...frame });
    retell();
    makeReachable();
    guard(root);
    if (performance.now() - confirmed < CONFIRM_MS) return;
    confirmed = performance.now();
    send({ drawn: model.get("number") });
  };
  // What scrolls can be scrolled by keyboard; so can a view whose controls are disabled.
  const makeReachable = () => {
    const scrolls = place.scrollWidth > place.clientWidth || place.scrollHeight > place.clientHeight;
    if (scrolls || stage.disabled) place.tabIndex = 0;
    else place.removeAttribute("tabindex");
  };
  // Text that somebody has marked, to copy it, stands still until it is let go of.
  const retell = () => {
    const marked = document.getSelection();
    if (marked && !marked.isCollapsed && marked.containsNode(words, true)) return;
    if (words.textContent !== model.get("words")) words.textContent = model.get("words");
  };
  // At most one drawing a screen refresh, always of the latest frame.
  const refresh = () => {
    alive();
    waiting ||= requestAnimationFrame(draw);
  };
  // What is drawn to fit its place is drawn again when that changes, also when nothing else comes.
  let width = 0;
  const resized = new ResizeObserver(() => {
    makeReachable();
    if (width === stage.clientWidth) return;
    width = stage.clientWidth;
    waiting ||= requestAnimationFrame(draw);
  });
  const say = () => {
    const ended = model.get("ended");
    const over = dead ? DEAD : ended;
    const text = over || (busy && BUSY) || model.get("notice");
    root.classList.toggle("rosview-over", Boolean(over));
    // A fieldset disables what is in it, and what is disabled for reasons of its own stays so.
    stage.disabled = Boolean(over);
    makeReachable();
    if (status.textContent !== text) status.textContent = text;
  };
  // JupyterLab says that the connection has changed, not how: a kernel that lives answers.
  const connection = () => {
    dead = true;
    say();
    send({ hello: true });
  };
  const alive = () => {
    if (dead) {
      dead = false;
      say();
    }
  };
  const heard = (message) => message?.here && answered();
  // The widgets' manager passes restarts on, and neither "Shut Down Kernel" nor a crash.
  const session = model.widget_manager?.context?.sessionContext;
  const kernelStatus = (_, now) => { if (ENDINGS.includes(now)) connection(); };

  document.addEventListener("selectionchange", retell);
  model.on("change:number", refresh);
  model.on("change:ended", say);
  model.on("change:notice", say);
  model.on("comm_live_update", connection);
  model.on("msg:custom", heard);
  session?.kernelChanged?.connect(connection);
  session?.statusChanged?.connect(kernelStatus);
  draw();
  say();
  resized.observe(stage);
  return () => {
    resized.disconnect();
    clearTimeout(question);
    cancelAnimationFrame(waiting);
    document.removeEventListener("selectionchange", retell);
    model.off("change:number", refresh);
    model.off("change:ended", say);
    model.off("change:notice", say);
    model.off("comm_live_update", connection);
    model.off("msg:custom", heard);
    session?.kernelChanged?.disconnect(connection);
    session?.statusChanged?.disconnect(kernelStatus);
    drawing.stop?.();
    root.remove();
  };
}
