// SPDX-License-Identifier: GPL-2.0-or-later
// The drawing itself: the SVG as the engine has made it fit to be shown, drawn by the browser.

const DIMMED = "[data-dim] { opacity: .3 !important; }";

export class Drawing {
  constructor(host, view) {
    // Its ids and style sheets are its own; the page's are not touched by them.
    Object.assign(this, { view, shadow: host.attachShadow({ mode: "open" }), byKey: new Map() });
  }

  show(text) {
    const parsed = new DOMParser().parseFromString(text, "image/svg+xml");
    const root = document.importNode(parsed.documentElement, true);
    this.view.place(root);
    const dimmed = document.createElement("style");
    dimmed.textContent = DIMMED;
    this.byKey = new Map();
    for (const element of root.querySelectorAll("[data-k]")) this.byKey.set(element.dataset.k, element);
    this.shadow.replaceChildren(root, dimmed);
  }

  /** Set attributes: {key: {name: value, or null for none}}. */
  change(paths) {
    for (const [key, attributes] of Object.entries(paths)) {
      const element = this.byKey.get(key);
      if (!element) continue;
      for (const [name, value] of Object.entries(attributes)) {
        if (value === null) element.removeAttribute(name);
        else element.setAttribute(name, value);
      }
    }
  }

  element(key) {
    return this.byKey.get(String(key));
  }
}
