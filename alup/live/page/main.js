// SPDX-License-Identifier: GPL-2.0-or-later
// The page: puts the drawing, its pins and the hand together, and asks the engine.

import { Drawing } from "./drawing.js";
import { Hand } from "./hand.js";
import { ask, enter, Gone, Latest, Refused, stay } from "./link.js";
import { Pins } from "./pins.js";
import { Regular } from "./regular.js";
import { View } from "./view.js";

// In milliseconds: how long a hand rests before the answer is asked for, and then the whole document.
const REST = 120, SETTLE = 200;
// So long an answer may take without a word.
const PATIENCE = 300;

const one = (id) => document.getElementById(id);

class Work {
  constructor(opened) {
    this.words = opened.words;
    this.stage = one("stage");
    this.view = new View(this.stage, one("desk"), one("paper"));
    this.pins = new Pins(one("pins"), one("over"), this.view, this.words);
    this.lines = new Regular(one("lines"), this.view);
    this.view.changed = () => {
      this.lines.place();
      this.light(null);
      this.pins.draw();
    };
    this.view.open(opened.box, opened.bounds);
    this.drawing = new Drawing(one("now"), this.view);
    this.original = new Drawing(one("original"), this.view);
    this.drawing.show(opened.svg);
    this.original.show(opened.svg);
    if (opened.ground) one("paper").style.background = opened.ground;
    this.drags = new Latest("drag", (...found) => this.dragged(...found), (error) => this.failed(error));
    this.hovers = new Latest("near", (found) => this.lightUp(found), () => {});
    this.hovered = false;
    this.held = null;
    this.rest = null;
    this.version = 0;
    this.regular = false; // whether something is, as far as is known
    this.hand = new Hand(this.stage, this.view, this.pins, this);
    this.bar();
    one("first").hidden = !opened.first;
    this.take(opened);
    this.say(this.words.hint);
    if (opened.grips.length) this.changed(true);
    this.findRegular();
    new ResizeObserver(() => this.view.apply()).observe(this.stage);
  }

  bar() {
    for (const id of ["hold", "method", "symmetric", "kept"]) one(id).addEventListener("change", () => this.choose());
    for (const id of ["undo", "redo", "done", "cancel"]) one(id).addEventListener("click", () => this[id]());
    one("shown").addEventListener("change", () => this.showRegular());
    one("fit").addEventListener("click", () => this.view.fit());
    one("delete").addEventListener("click", () => this.remove());
    one("before").addEventListener("pointerdown", () => this.before(true));
    for (const name of ["pointerup", "pointerleave", "pointercancel"]) {
      one("before").addEventListener(name, () => this.before(false));
    }
  }

  // --- what the engine says -------------------------------------------------------------------

  /** Handles, and what can be done. */
  take(state) {
    this.pins.set(state.grips, state.axis, this.held);
    one("undo").disabled = !state.undo;
    one("redo").disabled = !state.redo;
    one("hold").value = state.hold;
    one("method").value = state.method;
    one("symmetric").checked = state.symmetric;
    one("kept").checked = state.regular;
    one("kept").disabled = !state.keeps || !this.regular;
    this.selection();
  }

  selection() {
    one("delete").disabled = !this.pins.selected;
  }

  dragged(found, question, stamp) {
    this.picture(found);
    this.take(found);
    if (stamp !== undefined) requestAnimationFrame(() => this.painted(stamp));
    if (!this.drags.wanted) this.changed(false);
  }

  /** A frame or an answer: what has changed of the paths, and the lines over what is regular, if they are shown. */
  picture({ paths, lines }) {
    this.drawing.change(paths);
    if (lines !== undefined) this.lines.show(lines);
  }

  /** Say what is regular, which the engine looks for when the drawing is seen. */
  async findRegular() {
    try {
      const { said, keeps } = await ask("regular");
      this.regular = Boolean(said);
      one("found").classList.toggle("none", !said);
      one("kept").disabled = !said || !keeps;
      one("shown").disabled = !said;
      one("said").textContent = one("said").title = said || this.words.nothing_regular;
      one("found").setAttribute("aria-label", `${this.words.regular} ${one("said").textContent}`);
      one("found").hidden = false;
    } catch (error) {
      this.failed(error);
    }
  }

  async showRegular() {
    try {
      this.lines.show((await ask("show_regular", { shown: one("shown").checked })).lines);
    } catch (error) {
      this.failed(error);
    }
  }

  /** Leave in the browser's own records how long a picture took from the pointer's event on. */
  painted(stamp) {
    const channel = new MessageChannel();
    channel.port1.onmessage = () => {
      if (performance.getEntriesByName("picture").length > 5000) performance.clearMeasures("picture");
      performance.measure("picture", { start: stamp });
    };
    channel.port2.postMessage(0);
  }

  /** Something is not as it was: once the hand rests, have it exactly, and then all of it. */
  changed(dropped) {
    this.version += 1;
    document.documentElement.dataset.settled = "false";
    clearTimeout(this.rest);
    this.rest = setTimeout(() => this.resting(this.version, dropped), REST);
  }

  async resting(version, dropped) {
    const patience = setTimeout(() => this.say(this.words.refining, false), PATIENCE);
    const current = () => version === this.version;
    try {
      const answer = await ask("answer");
      if (answer.late || !current()) return;
      this.picture(answer);
      if (!dropped && this.hand.drag) return;
      await new Promise((resolve) => setTimeout(resolve, SETTLE));
      if (!current()) return;
      const settled = await ask("settle");
      if (settled.late) return;
      if (settled.svg) this.drawing.show(settled.svg);
      else this.drawing.change(settled.paths);
      if (!current()) return;
      document.documentElement.dataset.settled = "true";
      this.tell(settled);
    } catch (error) {
      this.failed(error);
    } finally {
      clearTimeout(patience);
    }
  }

  tell({ said, seconds }) {
    const grips = this.pins.grips;
    if (said.length) this.say(said.join(" "), true);
    else if (!grips.length) this.say(this.words.hint);
    else this.say(this.words.ready.replace("{seconds}", seconds.toFixed(1)));
  }

  say(text, told = false) {
    one("line").textContent = text;
    one("line").title = text;
    one("line").classList.toggle("told", told);
  }

  failed(error) {
    if (error instanceof Refused) this.say(error.message, true);
    else if (!this.over) this.finish(this.words.lost);
  }

  // --- what the hand does ---------------------------------------------------------------------

  begun() {
    one("first").hidden = true;
  }

  hover(at, reach) {
    this.hovered = at !== null;
    if (at) this.hovers.want({ at, reach });
    else this.light(null);
  }

  lightUp(found) {
    this.light(this.hovered && found ? this.drawing.element(found.key) : null);
    this.stage.classList.toggle("curve", Boolean(this.hovered && found));
  }

  light(element) {
    const d = element?.getAttribute("d");
    const matrix = d && element.getScreenCTM();
    if (!matrix) {
      if (!this.pins.lit) return;
      this.pins.lit = null;
      this.stage.classList.remove("curve");
    } else {
      const box = this.stage.getBoundingClientRect();
      const { a, b, c, d: down, e, f } = matrix;
      this.pins.lit = { d, matrix: `matrix(${[a, b, c, down, e - box.left, f - box.top]})` };
    }
    this.pins.drawLines();
  }

  async press(at, reach) {
    try {
      const found = await ask("press", { at, reach });
      this.take(found);
      return found.name;
    } catch (error) {
      this.failed(error);
      return null;
    }
  }

  prepare() {
    this.selection();
    ask("prepare").catch((error) => this.failed(error));
  }

  drag(name, to, stamp) {
    this.held = name;
    clearTimeout(this.rest);
    this.version += 1;
    document.documentElement.dataset.settled = "false";
    this.pins.place(name, to);
    this.drags.want({ name, to }, stamp);
  }

  async drop() {
    await this.drags.idle();
    this.held = null;
    await this.step("drop");
  }

  frame(from, to) {
    return this.step("frame", { from, to });
  }

  remove() {
    const name = this.pins.selected;
    if (!name) return undefined;
    return this.step("remove", { names: [name] });
  }

  undo() {
    return this.step("undo");
  }

  redo() {
    return this.step("redo");
  }

  async choose() {
    const [hold, method] = [one("hold").value, one("method").value];
    const [symmetric, regular] = [one("symmetric").checked, one("kept").checked];
    await this.step("choose", { hold, method, symmetric, regular });
    await this.findRegular(); // of what goes along now
  }

  /** Something that is one step.  It waits for the last one, whose state would else be shown after its own. */
  async step(name, question = {}) {
    const last = this.stepping;
    let end;
    this.stepping = new Promise((resolve) => { end = resolve; });
    await last;
    try {
      const state = await ask(name, question);
      this.take(state);
      if (state.name) this.pins.select(state.name, true);
      this.selection();
      this.changed(true);
    } catch (error) {
      this.failed(error);
    } finally {
      end();
    }
  }

  before(shown) {
    this.stage.classList.toggle("before", shown);
    one("original").hidden = !shown;
    one("now").hidden = shown;
  }

  // --- the end --------------------------------------------------------------------------------

  async done() {
    this.say(this.words.writing);
    try {
      await this.drags.idle();
      this.over = true;
      await ask("done");
      this.finish(this.words.ended);
    } catch (error) {
      this.over = false;
      this.failed(error);
    }
  }

  async cancel() {
    this.over = true;
    try {
      await ask("cancel");
    } finally {
      this.finish(this.words.ended);
    }
  }

  finish(text) {
    this.over = true;
    clearTimeout(this.rest);
    for (const element of document.querySelectorAll("header button, header select, header input, footer input")) {
      element.disabled = true;
    }
    one("ended").hidden = false;
    one("ended").firstElementChild.textContent = text;
    this.stage.inert = true;
    this.say(text, true);
    close();
  }
}

function translate(words) {
  document.documentElement.lang = words.language;
  document.title = words.title;
  for (const element of document.querySelectorAll("[data-word]")) {
    element.textContent = words[element.dataset.word];
  }
  for (const element of document.querySelectorAll("[data-tip]")) {
    element.title = words[element.dataset.tip];
    if (!element.dataset.word && element.localName === "button") element.setAttribute("aria-label", element.title);
  }
  one("stage").setAttribute("aria-label", words.canvas);
}

async function begin() {
  if (!(await enter())) throw new Gone();
  const staying = stay();
  const opened = await ask("open");
  translate(opened.words);
  const work = new Work(opened);
  document.documentElement.dataset.ready = "";
  await staying;
  if (!work.over) work.finish(work.words.lost);
}

begin().catch(() => {
  const ended = one("ended");
  ended.hidden = false;
  ended.firstElementChild.textContent = "This page belongs to a window of ALUP Reshape that is not open any more.";
});
