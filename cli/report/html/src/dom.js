// Elements from plain values. Texts of a capture are untrusted: they only ever become text nodes and attribute values of
// elements made here, never markup.

export function h(tag, attributes, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else element.setAttribute(name === "className" ? "class" : name, value === true ? "" : String(value));
  }
  append(element, children);
  return element;
}

/// Children may be nested lists; null, undefined and false are left out.
export function append(element, children) {
  for (const child of children) {
    if (child === null || child === undefined || child === false) continue;
    if (Array.isArray(child)) append(element, child);
    else element.append(child instanceof Node ? child : document.createTextNode(String(child)));
  }
}

/// columns: [{title, value: row => content, num, long}]; nothing when there are no rows.
export function table(rows, columns, caption, className) {
  if (rows.length === 0) return null;
  const kind = (column) => [column.num && "num", column.long && "long"].filter(Boolean).join(" ") || null;
  return h("div", { className: "scroll", tabindex: "0" },
    h("table", { className },
      caption && h("caption", null, caption),
      h("thead", null, h("tr", null, columns.map((c) => h("th", { scope: "col", className: kind(c) }, c.title)))),
      h("tbody", null, rows.map((row) =>
        h("tr", null, columns.map((c) => h("td", { className: kind(c), "data-title": c.title }, c.value(row))))))));
}

/// [[term, description]]; entries without description are left out.
export function facts(entries, className) {
  return h("dl", { className }, entries.filter(([, value]) => value !== null && value !== undefined && value !== "")
    .map(([term, value]) => h("div", null, h("dt", null, term), h("dd", null, value))));
}

let toast;
/// Says something for a moment, also to screen readers.
export function announce(text) {
  if (!toast) {
    toast = h("div", { className: "toast", role: "status", "aria-live": "polite" });
    document.body.append(toast);
  }
  toast.textContent = text;
  toast.classList.add("on");
  clearTimeout(announce.timer);
  announce.timer = setTimeout(() => toast.classList.remove("on"), 1600);
}

async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    // Not every browser offers the clipboard to a page that was opened as a file.
    const area = h("textarea", { className: "sr", "aria-hidden": "true" });
    area.value = text;
    document.body.append(area);
    area.select();
    document.execCommand("copy");
    area.remove();
  }
  announce("Copied");
}

export function copyable(text, what) {
  return [h("code", { title: text }, text), h("button", { type: "button", onclick: () => copy(text) }, `Copy ${what}`)];
}
