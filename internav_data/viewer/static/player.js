// The expert, played action by action: camera beside the map.

import { episodePath, has, load, reason, source } from "viewer/data";
import { failure, h, icon } from "viewer/dom";

const PACE = 4;
const AHEAD = 8;

export class ExpertPlayer {
  constructor(facts, map) {
    this.facts = facts;
    this.map = map;
    this.path = `${episodePath(facts)}/play`;
    this.step = 0;
    this.timer = null;
    this.pictures = new Map();
    this.element = h("section", { class: "expert", "aria-labelledby": "expert-title" }, this.heading());
    if (facts.expert === null) {
      this.element.append(h("p", { class: "note" }, "No expert is stored with this episode."));
    } else if (!has(this.path)) {
      this.element.append(h("p", { class: "note" }, "This file does not hold the expert of this episode."));
    } else {
      this.wait = h("p", { class: "wait", role: "status" }, "Playing the expert once through …");
      this.element.append(this.wait);
      this.read();
    }
  }

  heading() {
    const { expert } = this.facts;
    const told = expert
      ? `${expert.steps} actions: ${expert.pushes} push${expert.pushes === 1 ? "" : "es"}, ` +
        `${expert.picks} pick${expert.picks === 1 ? "" : "s"}, ${expert.path_m.toFixed(2)} m walked`
      : "";
    return h("div", { class: "title" }, h("h2", { id: "expert-title" }, "Expert"), h("span", { class: "note" }, told));
  }

  async read() {
    try {
      this.play = await load(this.path);
    } catch (error) {
      this.wait.replaceWith(failure(error.message));
      return;
    }
    this.build();
    this.go(0, false);
  }

  build() {
    const last = this.play.moments.length - 1;
    const button = (label, name, act) =>
      h("button", { type: "button", "aria-label": label, title: label, onclick: act }, icon(name));
    this.image = h("img", { alt: "", width: 384, height: 384 });
    this.image.addEventListener("error", () => this.fail());
    this.toggle = button("Play", "play", () => this.flip());
    this.toggle.classList.add("main");
    this.slider = h("input", {
      type: "range", min: 0, max: last, value: 0, "aria-label": "Action of the expert",
      oninput: () => this.seek(Number(this.slider.value)),
    });
    this.caption = h("p", { class: "caption" });
    this.live = h("p", { class: "unseen", "aria-live": "polite" });
    this.speed = h(
      "select",
      { "aria-label": "Speed" },
      [0.5, 1, 2, 4].map((value) => h("option", { value, selected: value === 1 }, `${value}×`)),
    );
    this.screen = h("div", { class: "screen" }, this.image);
    this.wait.replaceWith(
      this.screen,
      this.caption,
      this.live,
      h("div", { class: "line" }, this.slider, this.ticks(last)),
      h(
        "div",
        { class: "transport" },
        button("First action", "first", () => this.seek(0)),
        button("One action back", "back", () => this.seek(this.step - 1)),
        this.toggle,
        button("One action ahead", "ahead", () => this.seek(this.step + 1)),
        button("Last action", "last", () => this.seek(last)),
        this.speed,
      ),
    );
  }

  /** Marks below the slider where the expert acts on an object. */
  ticks(last) {
    return h(
      "div",
      { class: "ticks", "aria-hidden": "true" },
      this.play.moments.map((moment, k) =>
        ["push", "pick", "drop"].includes(moment.kind)
          ? h("i", { class: moment.kind, style: `left:${(100 * k) / Math.max(1, last)}%`, title: moment.text })
          : null,
      ),
    );
  }

  async fail() {
    this.pause();
    this.screen.replaceChildren(failure(await reason(`${this.path}/${this.step}`)));
  }

  get ready() {
    return this.play !== undefined;
  }

  get playing() {
    return this.timer !== null;
  }

  flip() {
    if (!this.ready) {
      return;
    }
    if (this.playing) {
      this.pause();
      return;
    }
    if (this.step === this.play.moments.length - 1) {
      this.go(0);
    }
    this.label("Pause", "pause");
    this.schedule();
  }

  pause() {
    clearTimeout(this.timer);
    this.timer = null;
    if (this.ready) {
      this.label("Play", "play");
      this.live.textContent = this.caption.textContent;
    }
  }

  label(label, name) {
    this.toggle.replaceChildren(icon(name));
    this.toggle.title = label;
    this.toggle.setAttribute("aria-label", label);
  }

  schedule() {
    // Whoever watches sees what is about to be pushed, and what came of it.
    const { target, kind } = this.play.moments[this.step];
    const acts = target >= 0 || ["push", "pick", "drop"].includes(kind);
    const wait = (acts ? 3 : 1) / PACE / Number(this.speed.value);
    this.timer = setTimeout(async () => {
      if (this.step >= this.play.moments.length - 1) {
        this.pause();
        return;
      }
      this.go(this.step + 1);
      await this.image.decode().catch(() => {});
      if (this.timer !== null) {
        this.schedule();
      }
    }, wait * 1000);
  }

  seek(step) {
    if (this.ready) {
      this.pause();
      this.go(step);
      this.live.textContent = this.caption.textContent;
    }
  }

  /** Show the state after some actions. */
  go(step, onMap = true) {
    const last = this.play.moments.length - 1;
    this.step = Math.min(Math.max(step, 0), last);
    const moment = this.play.moments[this.step];
    this.image.src = this.address(this.step);
    this.image.alt = `Camera of the agent after ${this.step} actions`;
    for (let k = this.step + 1; k <= Math.min(this.step + AHEAD, last); k += 1) {
      this.fetchAhead(k);
    }
    const left = moment.path_steps === null ? "cut off from the goal" : `${moment.path_steps} steps to the goal`;
    this.caption.replaceChildren(
      h("b", {}, `${this.step}/${last}`),
      ` ${moment.text}`,
      h("span", { class: "togo" }, left),
    );
    this.caption.classList.toggle("bad", !moment.success);
    this.slider.value = String(this.step);
    this.slider.setAttribute("aria-valuetext", `${this.step} of ${last}: ${moment.text}`);
    if (onMap) {
      this.map.drawMoment(this.play, this.step);
    }
  }

  address(step) {
    return source(`${this.path}/${step}`) ?? "";
  }

  fetchAhead(step) {
    if (!this.pictures.has(step)) {
      const image = new Image();
      image.src = this.address(step);
      this.pictures.set(step, image);
    }
  }

  leave() {
    clearTimeout(this.timer);
    this.timer = null;
  }
}
