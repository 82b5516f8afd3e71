// SPDX-License-Identifier: GPL-2.0-or-later
// Pointer and keys: what is taken hold of, where it is dragged, what part of the drawing is seen.

import { middle } from "./pins.js";

// In pixels: how near a curve is hit, by a mouse or pen and by a finger; what is a drag and no click.
const REACH = 8, FINGER = 18, TREMBLE = 3;
const WHEEL = 0.0015, KEY_ZOOM = 1.25, KEY_STEP = 1, FAR_STEP = 10;

export class Hand {
  constructor(stage, view, pins, work) {
    Object.assign(this, { stage, view, pins, work, drag: null, space: false, fingers: new Map(), spread: null });
    stage.addEventListener("pointerdown", (event) => this.down(event));
    stage.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel"]) {
      stage.addEventListener(name, (event) => this.up(event));
    }
    stage.addEventListener("pointerleave", () => this.work.hover(null));
    stage.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    stage.addEventListener("focusin", (event) => {
      if (event.target.dataset.name && !this.drag) this.pins.select(event.target.dataset.name);
    });
    stage.addEventListener("contextmenu", (event) => event.preventDefault());
    addEventListener("keydown", (event) => this.key(event));
    addEventListener("keyup", (event) => this.released(event));
    addEventListener("blur", () => this.release());
  }

  at(event) {
    const box = this.stage.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  reach(event) {
    return (event.pointerType === "touch" ? FINGER : REACH) / this.view.scale;
  }

  down(event) {
    const at = this.at(event);
    this.work.begun();
    if (event.pointerType === "touch") {
      this.fingers.set(event.pointerId, at);
      if (this.fingers.size === 2) {
        this.abandon();
        this.spread = spread([...this.fingers.values()]);
        return;
      }
    }
    if (this.drag || event.button > 1) return;
    this.stage.setPointerCapture(event.pointerId);
    const drag = { pointer: event.pointerId, from: at, at, moved: false, kind: "wait", shift: event.shiftKey };
    this.drag = drag;
    if (this.space || event.button === 1) {
      event.preventDefault();
      drag.kind = "pan";
      this.stage.classList.add("panning");
      return;
    }
    const name = event.target.dataset?.name;
    if (name) {
      this.hold(drag, name, event.target.dataset.corner);
      return;
    }
    // Whether there is a curve the engine knows; what happens until it answers is not lost.
    this.work.press(this.view.toUser(at), this.reach(event)).then((found) => this.pressed(drag, found));
  }

  pressed(drag, name) {
    if (drag.abandoned) return;
    if (name) {
      this.hold(drag, name);
    } else {
      drag.kind = "band";
      this.pins.select(null);
      this.work.selection();
    }
    if (drag.moved) this.follow(drag);
    if (this.drag !== drag) this.ended(drag); // a flick is over before the answer comes
  }

  hold(drag, name, corner) {
    const grip = this.pins.grip(name);
    if (!grip) return;
    drag.kind = "grip";
    drag.name = name;
    drag.corner = corner === undefined ? null : Number(corner);
    drag.start = grip.now.map((point) => [...point]);
    this.pins.select(name, true);
    this.work.hover(null);
    this.work.prepare();
  }

  move(event) {
    const at = this.at(event);
    if (event.pointerType === "touch" && this.fingers.has(event.pointerId)) {
      this.fingers.set(event.pointerId, at);
      if (this.spread) return this.pinch();
    }
    const drag = this.drag;
    if (!drag) {
      if (event.pointerType !== "touch" && !this.space) {
        this.work.hover(event.target.dataset?.name ? null : this.view.toUser(at), this.reach(event));
      }
      return;
    }
    if (event.pointerId !== drag.pointer) return;
    if (drag.kind === "pan") this.view.pan(at[0] - drag.at[0], at[1] - drag.at[1]);
    drag.at = at;
    drag.shift = event.shiftKey;
    drag.stamp = event.timeStamp;
    drag.moved ||= Math.hypot(at[0] - drag.from[0], at[1] - drag.from[1]) > TREMBLE;
    if (drag.moved) this.follow(drag);
  }

  follow(drag) {
    if (drag.kind === "band") {
      this.pins.band = [this.view.toUser(drag.from), this.view.toUser(drag.at)];
      this.pins.drawLines();
    } else if (drag.kind === "grip") {
      this.work.drag(drag.name, this.target(drag), drag.stamp);
    }
  }

  /** Where the pointer wants the points of a grip. */
  target(drag) {
    let [dx, dy] = [drag.at[0] - drag.from[0], drag.at[1] - drag.from[1]].map((way) => way / this.view.scale);
    if (drag.corner !== null) return scaled(drag.start, drag.corner, [dx, dy], drag.shift);
    if (drag.shift) [dx, dy] = Math.abs(dx) > Math.abs(dy) ? [dx, 0] : [0, dy];
    return drag.start.map(([x, y]) => [x + dx, y + dy]);
  }

  up(event) {
    this.fingers.delete(event.pointerId);
    if (this.fingers.size < 2) this.spread = null;
    const drag = this.drag;
    if (!drag || event.pointerId !== drag.pointer) return;
    this.drag = null;
    this.stage.classList.remove("panning");
    this.ended(drag);
  }

  ended(drag) {
    const band = this.pins.band;
    if (drag.kind === "band" && drag.moved && band) this.work.frame(...band);
    else if (drag.kind === "grip") this.work.drop();
    this.pins.band = null;
    this.pins.drawLines();
  }

  /** Leave a drag, with what it moved back where it was. */
  abandon() {
    const drag = this.drag;
    this.drag = null;
    this.pins.band = null;
    if (!drag) return;
    drag.abandoned = true;
    if (drag.kind === "grip" && drag.moved) {
      this.work.drag(drag.name, drag.start);
      this.work.drop();
    }
    this.pins.drawLines();
  }

  pinch() {
    const now = spread([...this.fingers.values()]), before = this.spread;
    this.view.pan(now.at[0] - before.at[0], now.at[1] - before.at[1]);
    if (before.size > 0) this.view.zoom(now.size / before.size, now.at);
    this.spread = now;
  }

  wheel(event) {
    event.preventDefault();
    const unit = event.deltaMode === 1 ? 16 : 1;
    if (event.shiftKey) this.view.pan(-(event.deltaX || event.deltaY) * unit, 0);
    else this.view.zoom(Math.exp(-event.deltaY * unit * WHEEL), this.at(event));
  }

  key(event) {
    const command = event.ctrlKey || event.metaKey;
    const inBar = event.target.closest?.("header, footer");
    if (command && event.key.toLowerCase() === "z") {
      event.preventDefault();
      return event.shiftKey ? this.work.redo() : this.work.undo();
    }
    if (command && event.key.toLowerCase() === "y") {
      event.preventDefault();
      return this.work.redo();
    }
    if (command && event.key === "Enter") return this.work.done();
    if (event.key === "Escape") return this.drag ? this.abandon() : this.pins.select(null);
    if (command || event.altKey || inBar) return;
    this.work.begun();
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    const middle_ = [this.stage.clientWidth / 2, this.stage.clientHeight / 2];
    if (way && this.pins.selected) {
      event.preventDefault();
      this.nudge(way, event.shiftKey ? FAR_STEP : KEY_STEP);
    } else if (event.key === "Delete" || event.key === "Backspace") {
      event.preventDefault();
      this.work.remove();
    } else if (event.key === " ") {
      event.preventDefault();
      this.space = true;
      this.stage.classList.add("pan");
    } else if (event.key === "b" || event.key === "B") {
      this.work.before(true);
    } else if (event.key === "0") {
      this.view.fit();
    } else if (event.key === "+" || event.key === "=") {
      this.view.zoom(KEY_ZOOM, middle_);
    } else if (event.key === "-") {
      this.view.zoom(1 / KEY_ZOOM, middle_);
    }
  }

  nudge([dx, dy], pixels) {
    const step = pixels / this.view.scale, grip = this.pins.grip(this.pins.selected);
    this.work.drag(grip.name, grip.now.map(([x, y]) => [x + dx * step, y + dy * step]));
    this.nudged = true;
  }

  released(event) {
    if (event.key === " ") {
      this.space = false;
      this.stage.classList.remove("pan");
    }
    if (event.key === "b" || event.key === "B") this.work.before(false);
    if (this.nudged && event.key.startsWith("Arrow")) {
      this.nudged = false;
      this.work.drop();
    }
  }

  release() {
    this.space = false;
    this.stage.classList.remove("pan");
    this.work.before(false);
  }
}

function spread([one, other]) {
  return { at: middle([one, other]), size: Math.hypot(one[0] - other[0], one[1] - other[1]) };
}

/** The corners of a frame when one of them is dragged, and the one across stays; evenly, if so wanted. */
function scaled(start, corner, [dx, dy], evenly) {
  const across = start[(corner + 2) % 4], [next, last] = [start[(corner + 1) % 4], start[(corner + 3) % 4]];
  const u = [last[0] - across[0], last[1] - across[1]], v = [next[0] - across[0], next[1] - across[1]];
  const to = [start[corner][0] + dx - across[0], start[corner][1] + dy - across[1]];
  const area = u[0] * v[1] - u[1] * v[0];
  let a = (to[0] * v[1] - to[1] * v[0]) / area, b = (u[0] * to[1] - u[1] * to[0]) / area;
  if (evenly) a = b = (a + b) / 2;
  [a, b] = [Math.max(a, 0.02), Math.max(b, 0.02)];
  const found = [...start];
  found[(corner + 3) % 4] = [across[0] + a * u[0], across[1] + a * u[1]];
  found[(corner + 1) % 4] = [across[0] + b * v[0], across[1] + b * v[1]];
  found[corner] = [across[0] + a * u[0] + b * v[0], across[1] + a * u[1] + b * v[1]];
  return found;
}
