// The quiz in the browser: native controls, nothing but letters and numbers back to the kernel.
//
// HTML is set only from what the kernel rendered of the bank's own Markdown; all else is text.

const REPLY_WAIT = 5000; // ms until a kernel that says nothing is worth a sentence
const DEAD =
  "The kernel of this notebook was restarted, so this quiz is not connected any more. " +
  "Run this cell again: your answers and attempts are kept.";
const SILENT =
  "The kernel does not answer. If it is busy with another cell, your answers are saved when " +
  "that cell is done. If it was restarted, run this cell again: your answers are kept.";
const OPEN = "-"; // a left side without a right one
const FOCUSABLE = "a, button, input, select, pre[tabindex], [tabindex]";

let views = 0;

/** Make an element; `on...` are listeners, `html` is from the kernel, other keys are attributes. */
function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "html") element.innerHTML = value;
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== null) element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

class QuizView {
  constructor(model, el) {
    this.model = model;
    this.id = `quiz-${Date.now().toString(36)}-${(views += 1)}`;
    this.messages = 0;
    this.pending = new Set();
    this.connection = "live";
    this.focusOn = null;
    this.root = make("section", { class: "quiz", "aria-labelledby": `${this.id}-title` });
    // JupyterLab listens on the document; what is typed in the quiz is for the quiz alone.
    for (const name of ["keydown", "keypress", "keyup"]) {
      this.root.addEventListener(name, (event) => event.stopPropagation());
    }
    el.append(this.root);
    this.onChange = () => queueMicrotask(() => this.refresh());
    this.onMessage = (content) => this.receive(content);
    // A model is born connected, and this comes when its kernel goes; a reply proves otherwise.
    this.onConnection = () => this.disconnect();
    for (const name of ["paper", "answers", "result", "notice"]) {
      model.on(`change:${name}`, this.onChange);
    }
    model.on("msg:custom", this.onMessage);
    model.on("comm_live_update", this.onConnection);
    this.build();
    this.refresh();
    this.send({ type: "hello" });
  }

  dispose() {
    clearTimeout(this.timer);
    for (const name of ["paper", "answers", "result", "notice"]) {
      this.model.off(`change:${name}`, this.onChange);
    }
    this.model.off("msg:custom", this.onMessage);
    this.model.off("comm_live_update", this.onConnection);
    this.root.remove();
  }

  get paper() {
    return this.model.get("paper");
  }

  // Talking to the kernel

  send(content) {
    const id = `${this.id}-${(this.messages += 1)}`;
    this.pending.add(id);
    const place = { view: this.id, order: this.messages }; // they may arrive out of order
    this.model.send({ ...content, ...place, attempt: this.paper.attempt, id });
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.setConnection("silent"), REPLY_WAIT);
    this.showSaved();
  }

  receive(content) {
    if (!this.pending.delete(content?.id)) return; // for another window on the same quiz
    clearTimeout(this.timer);
    if (this.pending.size > 0) {
      this.timer = setTimeout(() => this.setConnection("silent"), REPLY_WAIT);
    }
    this.setConnection("live");
    this.onChange();
  }

  disconnect() {
    clearTimeout(this.timer);
    this.setConnection("dead");
  }

  setConnection(state) {
    if (this.connection === state) return;
    this.connection = state;
    this.refresh();
  }

  // Building

  build() {
    const paper = this.paper;
    this.attempt = paper.attempt;
    this.answers = {};
    this.controls = new Map();
    this.title = make("h2", { id: `${this.id}-title`, class: "quiz-title", tabindex: "-1" }, paper.title);
    this.meta = make("p", { class: "quiz-meta" });
    this.alarm = make("p", { class: "quiz-alarm", role: "alert" });
    this.notice = make("p", { class: "quiz-notice", role: "status" });
    this.result = make("p", { class: "quiz-result", tabindex: "-1" });
    this.submit = make("button", { type: "button", class: "quiz-main", onclick: () => this.onSubmit() }, "Submit answers");
    this.retry = make("button", { type: "button", class: "quiz-main", onclick: () => this.onRetry() }, "Try another quiz");
    this.saved = make("span", { class: "quiz-saved" });
    this.status = make("p", { class: "quiz-status", role: "status" });
    const questions = paper.questions.map((question) => this.buildQuestion(question));
    this.root.replaceChildren(
      this.title, this.meta, this.alarm, this.notice, this.result, ...questions,
      make("div", { class: "quiz-actions" }, this.submit, this.retry, this.saved),
      this.status,
    );
    this.guard(this.root);
  }

  buildQuestion(question) {
    const id = `${this.id}-q${question.number}`;
    const count = this.paper.questions.length;
    const fieldset = make(
      "fieldset", { class: "quiz-question", "aria-describedby": `${id}-stem ${id}-feedback` },
      make("legend", {}, make("span", { class: "quiz-number" }, `Question ${question.number} of ${count}`),
        ` ${question.instruction}`),
      make("div", { id: `${id}-stem`, class: "quiz-stem", html: question.stem + question.code }),
    );
    const control = CONTROLS[question.kind](this, question, id);
    fieldset.append(...control.elements);
    const feedback = make("div", { id: `${id}-feedback`, class: "quiz-feedback" });
    this.controls.set(question.number, { ...control, question, fieldset, feedback });
    return make("div", { class: "quiz-item" }, fieldset, feedback);
  }

  /** JupyterLab's shortcuts leave an element alone only if the element itself says so. */
  guard(element) {
    for (const inner of element.querySelectorAll(FOCUSABLE)) {
      inner.setAttribute("data-lm-suppress-shortcuts", "true");
      if (inner.tagName === "A") {
        inner.setAttribute("target", "_blank");
        inner.setAttribute("rel", "noopener noreferrer");
      }
    }
  }

  // Showing

  refresh() {
    if (this.paper.attempt !== this.attempt) this.build();
    if (this.pending.size === 0) this.showAnswers();
    const result = this.model.get("result");
    const done = result !== null && result.attempt === this.attempt;
    const dead = this.connection === "dead";
    const { attempt, needed, standing } = this.paper;
    this.meta.textContent = [`Attempt ${attempt}. ${needed}.`, standing].filter(Boolean).join(" ");
    setText(this.alarm, { dead: DEAD, silent: SILENT, live: "" }[this.connection]);
    setText(this.notice, this.model.get("notice"));
    setText(this.result, done ? result.headline : "");
    this.result.dataset.passed = done && result.passed !== null ? String(result.passed) : "";
    for (const control of this.controls.values()) control.fieldset.disabled = done || dead;
    this.submit.hidden = done;
    this.retry.hidden = !done || !this.paper.more;
    for (const button of [this.submit, this.retry]) button.disabled = dead || this.waitingFor !== undefined;
    this.showFeedback(done ? result : null);
    this.showSaved();
    this.moveFocus(done);
  }

  showAnswers() {
    const answers = this.model.get("answers");
    for (const [number, control] of this.controls) {
      const answer = answers[String(number)] ?? "";
      if (this.answers[number] !== answer) {
        this.answers[number] = answer;
        control.show(answer);
      }
    }
  }

  showFeedback(result) {
    if (this.feedbackFor === result) return;
    this.feedbackFor = result;
    for (const [number, { feedback, fieldset }] of this.controls) {
      const mark = result?.marks.find((one) => one.number === number);
      feedback.replaceChildren(...(mark ? this.buildFeedback(mark) : []));
      fieldset.dataset.right = mark ? String(mark.right) : "";
      feedback.dataset.right = fieldset.dataset.right;
      this.guard(feedback);
    }
  }

  buildFeedback(mark) {
    const sign = make("span", { "aria-hidden": "true", class: "quiz-sign" }, mark.right ? "✔" : "✘");
    const parts = [make("p", { class: "quiz-verdict" }, sign, ` Question ${mark.number}: ${mark.verdict}`)];
    for (const remark of mark.remarks) {
      const label = remark.letter ? [make("strong", {}, `${remark.letter})`)] : [];
      parts.push(make("div", { class: "quiz-remark" }, ...label, make("div", { html: remark.html })));
      if (remark.show) parts.push(this.buildCell("See it happen in a cell of your own", remark.show));
    }
    if (mark.key) {
      parts.push(make("div", { class: "quiz-key" }, make("strong", {}, "Right answer:"), make("div", { html: mark.key })));
    }
    if (mark.run) parts.push(this.buildCell("Now run it in a cell of your own", mark.run));
    return parts;
  }

  buildCell(label, cell) {
    const copy = make("button", { type: "button", class: "quiz-copy", onclick: () => this.onCopy(cell.source) }, "Copy the code");
    return make("details", { class: "quiz-cell" },
      make("summary", { tabindex: "0" }, label), make("div", { html: cell.html }), copy);
  }

  showSaved() {
    const submitted = this.model.get("result") !== null;
    const saving = this.pending.size > 0 ? "Saving…" : "Answers saved.";
    const untouched = Object.values(this.answers).every((answer) => answer === "");
    const quiet = submitted || this.connection !== "live" || this.model.get("notice") || untouched;
    setText(this.saved, quiet ? "" : saving);
  }

  moveFocus(done) {
    if (this.waitingFor === undefined || this.pending.has(this.waitingFor)) return;
    const wanted = this.focusOn;
    this.waitingFor = undefined;
    this.focusOn = null;
    for (const button of [this.submit, this.retry]) button.disabled = false;
    if (wanted === "result" && done) this.result.focus();
    else if (wanted === "title" && !done) this.title.focus();
  }

  announce(sentence) {
    setText(this.status, sentence);
  }

  // What the learner does

  change(number, answer) {
    this.answers[number] = answer;
    this.announce("");
    this.send({ type: "answer", number, answer });
  }

  onSubmit() {
    if (this.waitingFor !== undefined) return;
    for (const [number, control] of this.controls) {
      if (!control.complete(this.answers[number] ?? "")) {
        this.announce(`Not submitted yet: question ${number} has no complete answer.`);
        control.focus();
        return;
      }
    }
    this.ask({ type: "submit", answers: this.answers }, "result");
  }

  onRetry() {
    if (this.waitingFor === undefined) this.ask({ type: "retry" }, "title");
  }

  ask(content, focusOn) {
    this.announce("");
    this.focusOn = focusOn;
    this.send(content);
    this.waitingFor = `${this.id}-${this.messages}`;
    for (const button of [this.submit, this.retry]) button.disabled = true;
  }

  async onCopy(source) {
    try {
      await navigator.clipboard.writeText(source);
      this.announce("Copied: paste it into a new cell and run that.");
    } catch {
      this.announce("The browser does not allow copying: select the code and copy it yourself.");
    }
  }
}

function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
  element.hidden = !text && element.getAttribute("role") === null;
}

// Controls by kind of question: elements, `show(answer)`, `complete(answer)`, `focus()`.

function choices(type) {
  return (view, question, id) => {
    const inputs = question.options.map(({ letter }) =>
      make("input", { type, name: id, value: letter, onchange: () => {
        const chosen = inputs.filter((input) => input.checked).map((input) => input.value);
        view.change(question.number, chosen.join(""));
      } }));
    return {
      elements: question.options.map(({ letter, html }, index) =>
        make("label", { class: "quiz-option" }, inputs[index],
          make("span", { class: "quiz-letter" }, `${letter})`), make("span", { html }))),
      show: (answer) => inputs.forEach((input) => { input.checked = String(answer).includes(input.value); }),
      complete: (answer) => answer !== "",
      focus: () => inputs[0].focus(),
    };
  };
}

function numeric(view, question) {
  const send = () => view.change(question.number, input.value === "" ? "" : Number(input.value));
  const input = make("input", { type: "number", step: "any", class: "quiz-numeric", oninput: send });
  // Scrolling the page over a number in focus would change it unseen.
  input.addEventListener("wheel", () => input.blur(), { passive: true });
  return {
    elements: [make("label", { class: "quiz-option" }, "Your answer:", input, make("span", {}, question.unit))],
    show: (answer) => { input.value = String(answer); },
    complete: (answer) => answer !== "",
    focus: () => input.focus(),
  };
}

function ordering(view, question) {
  const list = make("ol", { class: "quiz-order" });
  const rows = new Map(question.options.map(({ letter, html, text }) => {
    const button = (name, step) => make("button", {
      type: "button", class: "quiz-move", "aria-label": `Move ${name}: ${text}`,
      onclick: (event) => move(letter, text, step, event.currentTarget),
    }, name === "up" ? "▲" : "▼");
    return [letter, make("li", {}, make("span", { class: "quiz-buttons" }, button("up", -1), button("down", 1)),
      make("span", { html }))];
  }));
  let order = [...rows.keys()];
  const arrange = () => {
    list.append(...order.map((letter) => rows.get(letter)));
    order.forEach((letter, place) => {
      const [up, down] = rows.get(letter).querySelectorAll("button");
      up.setAttribute("aria-disabled", String(place === 0));
      down.setAttribute("aria-disabled", String(place === order.length - 1));
    });
  };
  const move = (letter, text, step, button) => {
    const from = order.indexOf(letter);
    const to = from + step;
    if (to < 0 || to >= order.length) return;
    order.splice(to, 0, ...order.splice(from, 1));
    arrange();
    button.focus(); // a row that moves in the page loses the focus
    view.change(question.number, order.join(""));
    view.announce(`${text} is now at place ${to + 1} of ${order.length}.`);
  };
  arrange();
  return {
    elements: [list],
    show: (answer) => {
      order = answer === "" ? [...rows.keys()] : [...answer];
      arrange();
    },
    complete: (answer) => answer !== "",
    focus: () => list.querySelector("button").focus(),
  };
}

function matching(view, question, id) {
  const send = () => view.change(question.number, selects.map((select) => select.value).join(""));
  const selects = question.lefts.map((_, index) =>
    make("select", { id: `${id}-left${index}`, onchange: send },
      make("option", { value: OPEN }, "choose…"),
      ...question.options.map(({ letter, text }) => make("option", { value: letter }, `${letter}) ${text}`))));
  const rows = question.lefts.map(({ html }, index) =>
    make("div", { class: "quiz-pair" },
      make("label", { for: `${id}-left${index}`, html }), selects[index]));
  return {
    elements: rows,
    show: (answer) => selects.forEach((select, index) => { select.value = String(answer)[index] ?? OPEN; }),
    complete: (answer) => answer !== "" && !answer.includes(OPEN),
    focus: () => (selects.find((select) => select.value === OPEN) ?? selects[0]).focus(),
  };
}

const CONTROLS = {
  single: choices("radio"),
  predict: choices("radio"),
  multiple: choices("checkbox"),
  numeric,
  ordering,
  matching,
};

export default {
  render({ model, el }) {
    const view = new QuizView(model, el);
    return () => view.dispose();
  },
};
