// SPDX-License-Identifier: GPL-2.0-or-later
// What part of the drawing is seen, and how large: screen = scale * user + shift, in pixels of the stage.

const SMALLEST = 0.02, LARGEST = 200; // of the scale that shows the whole drawing

export class View {
  constructor(stage, desk, paper) {
    Object.assign(this, { stage, desk, paper, scale: 1, x: 0, y: 0, changed: () => {} });
  }

  /** box : x, y, width, height of the page in user units; bounds : [[x, y], [x, y]] of what is reshaped */
  open(box, bounds) {
    [this.box, this.bounds] = [box, bounds];
    // The drawing is laid out at a size of which a browser knows no limits, whatever its units are.
    this.layout = 1000 / Math.max(box[2], box[3]);
    this.fit();
  }

  /** Lay a drawing's root element out, so that its user units are what `scale` says. */
  place(root) {
    root.setAttribute("width", this.box[2] * this.layout);
    root.setAttribute("height", this.box[3] * this.layout);
    root.style.setProperty("width", this.box[2] * this.layout + "px", "important");
    root.style.setProperty("height", this.box[3] * this.layout + "px", "important");
    root.style.setProperty("overflow", "visible", "important");
    root.style.setProperty("display", "block", "important");
    root.style.setProperty("position", "static", "important");
  }

  /** Show the page, or what is reshaped where that reaches beyond it. */
  fit() {
    const [x, y, w, h] = this.box;
    const low = [Math.min(x, this.bounds[0][0]), Math.min(y, this.bounds[0][1])];
    const high = [Math.max(x + w, this.bounds[1][0]), Math.max(y + h, this.bounds[1][1])];
    // A small drawing on a large page is what one wants to see.
    const own = [this.bounds[1][0] - this.bounds[0][0], this.bounds[1][1] - this.bounds[0][1]];
    const small = own[0] < 0.5 * (high[0] - low[0]) && own[1] < 0.5 * (high[1] - low[1]);
    const [from, to] = small ? this.bounds : [low, high];
    const { clientWidth: width, clientHeight: height } = this.stage;
    const margin = small ? 0.2 : 0.06;
    const room = [Math.max(to[0] - from[0], 1e-9), Math.max(to[1] - from[1], 1e-9)];
    this.scale = this.whole = (1 - margin) * Math.min(width / room[0], height / room[1]);
    this.x = width / 2 - this.scale * (from[0] + to[0]) / 2;
    this.y = height / 2 - this.scale * (from[1] + to[1]) / 2;
    this.apply();
  }

  zoom(factor, at) {
    const scale = Math.min(Math.max(this.scale * factor, SMALLEST * this.whole), LARGEST * this.whole);
    const by = scale / this.scale;
    this.x = at[0] + by * (this.x - at[0]);
    this.y = at[1] + by * (this.y - at[1]);
    this.scale = scale;
    this.apply();
  }

  pan(dx, dy) {
    this.x += dx;
    this.y += dy;
    this.apply();
  }

  apply() {
    const [x, y, w, h] = this.box, size = this.scale / this.layout;
    const left = this.x + this.scale * x, top = this.y + this.scale * y;
    this.desk.style.transform = `matrix(${size},0,0,${size},${left},${top})`;
    Object.assign(this.paper.style, { width: w * this.layout + "px", height: h * this.layout + "px" });
    this.changed();
  }

  /** Pixels of the stage -> user units, and back. */
  toUser([x, y]) {
    return [(x - this.x) / this.scale, (y - this.y) / this.scale];
  }

  toScreen([x, y]) {
    return [this.scale * x + this.x, this.scale * y + this.y];
  }
}
