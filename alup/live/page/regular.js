// SPDX-License-Identifier: GPL-2.0-or-later
// Thin lines over what is regular, as the engine tells them: path data in user units, of firm and of faint ones.

const SVG = "http://www.w3.org/2000/svg";

export class Regular {
  /** over : the SVG for them, of the stage's size */
  constructor(over, view) {
    Object.assign(this, { over, view });
    this.group = document.createElementNS(SVG, "g");
    // Two tones of each, for any ground.
    this.paths = ["firm", "faint"].map((kind) => ["rim", "line"].map((tone) => {
      const path = document.createElementNS(SVG, "path");
      path.setAttribute("class", `${kind} ${tone}`);
      this.group.append(path);
      return path;
    }));
    over.append(this.group);
    this.place();
  }

  /** lines : [firm, faint] */
  show(lines) {
    this.over.toggleAttribute("hidden", !lines.some(Boolean));
    lines.forEach((d, n) => this.paths[n].forEach((path) => path.setAttribute("d", d)));
  }

  /** The view has changed. */
  place() {
    const { scale, x, y } = this.view;
    this.group.setAttribute("transform", `matrix(${[scale, 0, 0, scale, x, y]})`);
  }
}
