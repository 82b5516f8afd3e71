// SPDX-License-Identifier: GPL-2.0-or-later
// Pins and frames over the drawing: buttons of one size at any zoom, lines in two tones for any ground.

const SVG = "http://www.w3.org/2000/svg";

export class Pins {
  constructor(layer, over, view, words) {
    Object.assign(this, { layer, over, view, words, grips: [], selected: null, axis: null, band: null });
    this.buttons = new Map();
    this.lit = null;
  }

  /** grips : as the engine tells them; those that are held keep the place where the hand has them */
  set(grips, axis, held = null) {
    const kept = held && this.grips.find((grip) => grip.name === held);
    this.grips = grips.map((grip) => (kept && grip.name === held ? { ...grip, now: kept.now } : grip));
    this.axis = axis;
    if (!this.grips.some((grip) => grip.name === this.selected)) this.selected = null;
    this.draw();
  }

  grip(name) {
    return this.grips.find((grip) => grip.name === name);
  }

  place(name, now) {
    const grip = this.grip(name);
    if (grip) grip.now = now;
    this.draw();
  }

  select(name, focus = false) {
    this.selected = name;
    this.draw();
    if (focus && name) this.buttons.get(name)?.focus({ preventScroll: true });
  }

  draw() {
    this.drawButtons();
    this.drawLines();
  }

  drawButtons() {
    const wanted = new Map();
    const counts = { point: 0, frame: 0 };
    for (const grip of this.grips) {
      const number = ++counts[grip.kind];
      const word = (grip.kind === "frame" ? "frame" : "pin") + (grip.moved ? "_moved" : "");
      const label = this.words[word].replace("{number}", number);
      wanted.set(grip.name, { at: middle(grip.now), label, grip, corner: null });
      if (grip.kind === "frame" && grip.name === this.selected) {
        grip.now.forEach((at, corner) => {
          const name = `${grip.name}/${corner}`;
          wanted.set(name, { at, label: this.words.corner.replace("{number}", number), grip, corner });
        });
      }
    }
    for (const [name, button] of this.buttons) {
      if (!wanted.has(name)) {
        if (button === document.activeElement) this.view.stage.focus({ preventScroll: true });
        button.remove();
        this.buttons.delete(name);
      }
    }
    for (const [name, { at, label, grip, corner }] of wanted) {
      let button = this.buttons.get(name);
      if (!button) {
        button = document.createElement("button");
        button.dataset.name = grip.name;
        if (corner !== null) button.dataset.corner = corner;
        this.layer.append(button);
        this.buttons.set(name, button);
      }
      const kind = corner !== null ? "corner" : grip.kind;
      const states = [grip.moved && "moved", corner === null && grip.name === this.selected && "selected"];
      button.className = ["pin", kind, ...states.filter(Boolean)].join(" ");
      button.title = label;
      button.setAttribute("aria-label", label);
      const [x, y] = this.view.toScreen(at);
      button.style.transform = `translate(${x}px,${y}px)`;
    }
  }

  drawLines() {
    const parts = [];
    if (this.lit) {
      const { d, matrix } = this.lit;
      for (const name of ["rim", "lit"]) parts.push(made("path", { d, transform: matrix, class: name }));
    }
    if (this.axis) parts.push(...this.line(this.axis[0], this.axis[1], "axis"));
    for (const grip of this.grips) {
      const corners = grip.now.map((at) => this.view.toScreen(at).join(",")).join(" ");
      if (grip.moved && grip.kind === "point") parts.push(...this.line(grip.rest[0], grip.now[0], "way"));
      if (grip.kind !== "frame") continue;
      const state = (grip.moved ? " moved" : "") + (grip.name === this.selected ? " selected" : "");
      parts.push(made("polygon", { points: corners, class: "rim" }));
      parts.push(made("polygon", { points: corners, class: "edge" + state }));
      parts.push(made("polygon", { points: corners, class: "hold", "data-name": grip.name }));
    }
    if (this.band) {
      const points = corners(this.band[0], this.band[1]).map((at) => this.view.toScreen(at).join(","));
      for (const name of ["rim", "band"]) parts.push(made("polygon", { points: points.join(" "), class: name }));
    }
    this.over.replaceChildren(...parts);
  }

  line(from, to, name) {
    const [x1, y1] = this.view.toScreen(from), [x2, y2] = this.view.toScreen(to);
    return ["rim " + name, name].map((each) => made("line", { x1, y1, x2, y2, class: each }));
  }
}

export function middle(points) {
  const sum = points.reduce(([x, y], [u, v]) => [x + u, y + v], [0, 0]);
  return [sum[0] / points.length, sum[1] / points.length];
}

export function corners([a, b], [c, d]) {
  return [[a, b], [c, b], [c, d], [a, d]];
}

function made(tag, attributes) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
}
