// A form made of fields that the kernel describes: {path, takes, kind, default}.

/** Return {element, draw(fields, problem)}; `send(values)` gets what was typed, by path. */
function formFor(label, button, send) {
  const id = newId();
  const inputs = new Map();
  const grid = make("div", { class: "rosform-grid" });
  const problem = make("p", { class: "rosform-problem", role: "alert" });
  const element = make(
    "form", {
      class: "rosform", "aria-label": label,
      onsubmit: (event) => {
        event.preventDefault();
        send(Object.fromEntries([...inputs].map(([path, input]) => [path, valueOf(input)])));
      },
    },
    grid, make("button", { type: "submit" }, button), problem,
  );
  let known = "";
  return {
    element,
    draw(fields, said) {
      if (JSON.stringify(fields) !== known) {
        known = JSON.stringify(fields);
        inputs.clear();
        grid.replaceChildren(...fields.flatMap((field, number) => {
          const input = inputFor(field, `${id}-${number}`);
          inputs.set(field.path, input);
          return [
            make("label", { for: input.id }, field.path),
            make("span", {}, input, make("span", { class: "rosform-takes" }, field.takes)),
          ];
        }));
      }
      if (problem.textContent !== said) problem.textContent = said;
    },
  };
}

function inputFor(field, id) {
  if (field.kind === "checkbox") {
    return make("input", { type: "checkbox", id, checked: field.default === "true" });
  }
  return make("input", {
    type: "text", id, value: field.default, size: field.kind === "yaml" ? 28 : 14,
    inputmode: field.kind === "number" ? "decimal" : null, spellcheck: "false", autocomplete: "off",
  });
}

function valueOf(input) {
  return input.type === "checkbox" ? input.checked : input.value;
}

/** Data as one line of text: what a message looks like to people. */
function asText(data) {
  if (data === null || data === undefined) return "";
  if (Array.isArray(data)) return `[${data.map(asText).join(", ")}]`;
  if (typeof data === "object") {
    return `{${Object.entries(data).map(([key, value]) => `${key}: ${asText(value)}`).join(", ")}}`;
  }
  return String(data);
}
