// SPDX-License-Identifier: GPL-2.0-or-later
// The way to the engine: questions by POST, each with the key of this page.

let key = null;

/** Exchange the token in the address for a key, and take it out of the address. */
export async function enter() {
  const token = location.hash.slice(1);
  history.replaceState(null, "", location.pathname);
  if (!token) {
    key = sessionStorage.getItem("key"); // the page was loaded anew
    return key !== null;
  }
  const answer = await post("enter", { token });
  if (!answer.ok) return false;
  key = (await answer.json()).key;
  sessionStorage.setItem("key", key);
  return true;
}

function post(name, question) {
  const headers = { "Content-Type": "application/json" };
  if (key) headers["X-Alup-Key"] = key;
  return fetch("/" + name, { method: "POST", headers, body: JSON.stringify(question), cache: "no-store" });
}

/** Ask the engine; what it refuses is an Error with a sentence for the user. */
export async function ask(name, question = {}) {
  const answer = await post(name, question);
  if (!answer.ok) throw new Gone();
  const found = await answer.json();
  if (found && found.error) throw new Refused(found.error);
  return found;
}

/** The engine said no, in a sentence. */
export class Refused extends Error {}

/** The engine is not there any more. */
export class Gone extends Error {}

/** Hold a connection open, by which the engine knows that this page is there; resolves at its end. */
export async function stay() {
  try {
    const reader = (await post("alive", {})).body.getReader();
    while (!(await reader.read()).done);
  } catch {
    // the engine has gone, which is all there is to know
  }
}

/**
 * Questions of which only the newest matters: one is under way, and the next one is what was wanted last.
 * The next one leaves before the answer is shown, so that the engine works while the browser paints.
 */
export class Latest {
  constructor(name, show, fail) {
    Object.assign(this, { name, show, fail, wanted: null, busy: false, waiting: [] });
  }

  want(question, stamp) {
    this.wanted = { question, stamp };
    if (!this.busy) this.send();
  }

  /** Resolves when nothing is under way. */
  idle() {
    return this.busy ? new Promise((resolve) => this.waiting.push(resolve)) : Promise.resolve();
  }

  async send() {
    const { question, stamp } = this.wanted;
    this.wanted = null;
    this.busy = true;
    let found = null;
    try {
      found = await ask(this.name, question);
    } catch (error) {
      this.fail(error);
    }
    this.busy = false;
    if (this.wanted) this.send();
    if (found) this.show(found, question, stamp);
    if (!this.busy) this.waiting.splice(0).forEach((resolve) => resolve());
  }
}
