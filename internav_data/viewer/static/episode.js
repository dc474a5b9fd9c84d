// Page of an episode: map, expert, obstacles with their outcomes, the house in 3-D.

import { episodePath, has, has3d, load, reason, show3d, source } from "viewer/data";
import { calm, chip, failure, figure, h, some } from "viewer/dom";
import { EpisodeMap } from "viewer/map";
import { ExpertPlayer } from "viewer/player";

const PAD = [
  ["push_north", "↑", "n"],
  ["push_west", "←", "w"],
  ["pick", "pick", "c"],
  ["push_east", "→", "e"],
  ["push_south", "↓", "s"],
];
const FRAME_MS = 90;
let privileged = false;

export async function showEpisode({ dataset, parts, query }) {
  const [scene, index] = parts;
  if (parts.length !== 2 || !/^\d{1,9}$/.test(index)) {
    throw new Error("an episode's address looks like #/episode/scene-000017/3");
  }
  const here = { scene_id: scene, index: Number(index) };
  const facts = await load(episodePath(here));
  return new EpisodePage(dataset, facts, query).view();
}

class EpisodePage {
  constructor(dataset, facts, query) {
    this.dataset = dataset;
    this.facts = facts;
    this.query = query;
    this.map = new EpisodeMap(facts);
    this.player = new ExpertPlayer(facts, this.map);
    this.video = null;
    this.cards = facts.obstacles.map((obstacle) => new ObstacleCard(this, obstacle));
    this.toggle = h("input", {
      type: "checkbox", role: "switch", id: "privileged", checked: privileged,
      onchange: () => this.setPrivileged(this.toggle.checked),
    });
    this.beside = h("nav", { class: "beside", "aria-label": "Neighbouring episodes" });
    this.map.svg.addEventListener("pointerover", (event) => this.onMap(event));
    this.map.svg.addEventListener("click", (event) => this.onMap(event));
    this.map.svg.addEventListener("pointerleave", () => this.rest());
    this.element = this.build();
    this.setPrivileged(privileged);
    this.readNeighbours();
  }

  view() {
    return {
      element: this.element,
      leave: () => this.leave(),
      keys: {
        " ": () => this.expert((player) => player.flip()),
        ArrowLeft: () => this.expert((player) => player.seek(player.step - 1)),
        ArrowRight: () => this.expert((player) => player.seek(player.step + 1)),
        Home: () => this.expert((player) => player.seek(0)),
        End: () => this.expert((player) => player.seek(Infinity)),
        p: () => this.setPrivileged(!privileged),
        j: () => this.follow("after"),
        k: () => this.follow("before"),
        Escape: () => this.escape(),
      },
    };
  }

  expert(act) {
    this.stopVideo();
    act(this.player);
  }

  leave() {
    this.stopVideo();
    this.player.leave();
  }

  escape() {
    if (this.video !== null || this.player.step > 0 || this.player.playing) {
      this.stopVideo();
      this.player.seek(0);
      this.map.clearAgent();
      this.map.reset();
      return;
    }
    location.hash = this.gallery();
  }

  gallery() {
    return `#/episodes${String(this.query) ? `?${this.query}` : ""}`;
  }

  build() {
    const { facts } = this;
    return h(
      "article",
      { class: "episode" },
      h(
        "header",
        { class: "head" },
        h("div", {}, h("a", { href: this.gallery(), class: "back" }, "← Episodes"), h("h1", {}, facts.episode_id)),
        h(
          "div",
          { class: "chips" },
          chip(facts.mode, facts.mode),
          facts.sealed ? chip("sealed", "sealed") : null,
          chip(facts.split, "split"),
        ),
        this.beside,
      ),
      this.figures(),
      h(
        "div",
        { class: "columns" },
        h("div", { class: "left" }, this.map.element, this.legend()),
        h("div", { class: "right" }, this.player.element, this.outcomes()),
      ),
      this.house3d(),
    );
  }

  figures() {
    const { facts } = this;
    const d = facts.distances;
    const among =
      d.obstructed_path_steps !== null
        ? `${d.obstructed_path_steps} steps, ${figure(d.obstructed_path_m)} m`
        : d.obstructed_path_m !== null
          ? `cut off on the lattice, ${figure(d.obstructed_path_m)} m off it`
          : "cut off";
    const pairs = [
      ["Path without obstacles", `${d.shortest_path_steps} steps, ${figure(d.shortest_path_m)} m`],
      ["Among the obstacles", among],
      ["From", facts.start.room_name],
      ["To", facts.goal.room_name],
      ["House", `${some(facts.house.rooms, "room")}, ${facts.house.area_m2} m², ${some(facts.house.objects, "object")}`],
      ["Physics", facts.engine],
    ];
    return h("dl", { class: "figures" }, pairs.map(([name, value]) => h("div", {}, h("dt", {}, name), h("dd", {}, value))));
  }

  legend() {
    const entries = [
      ["start", "start"], ["goal", "goal"], ["push", "to push"], ["pick", "to pick up"], ["fixed", "fixed"],
      ["agentmark", "expert"], ["pathmark", "node path"], ["ghostmark", "where it was"],
    ];
    return h(
      "ul",
      { class: "legend", "aria-label": "Legend" },
      entries.map(([kind, text]) => h("li", {}, h("i", { class: kind, "aria-hidden": "true" }), text)),
    );
  }

  outcomes() {
    const hidden = this.dataset.hidden_attributes;
    return h(
      "section",
      { class: "obstacles", "aria-labelledby": "obstacles-title" },
      h(
        "div",
        { class: "title" },
        h("h2", { id: "obstacles-title" }, "Obstacles and their outcomes"),
        h(
          "label",
          { class: "switch", for: "privileged" },
          this.toggle,
          h("span", {}, "Hidden attributes ", chip("privileged", "privileged")),
        ),
      ),
      h(
        "p",
        { class: "note" },
        "Point at an arrow to see where that push puts the obstacle and what it takes along; press it for the video. ",
        "All from the stored poses, everything else as the episode starts. ",
        hidden ? "This dataset hides mass, friction and fixedness: looks do not tell them." : null,
      ),
      this.cards.map((card) => card.element),
    );
  }

  house3d() {
    const place = h("div", { class: "frame3d" });
    const open = () => {
      const frame = h("iframe", {
        title: `House of ${this.facts.episode_id} in 3-D: drag to turn, wheel to come nearer`,
        sandbox: "allow-scripts", tabindex: 0,
      });
      show3d(frame, this.facts);
      place.replaceChildren(frame);
    };
    const button = h("button", { type: "button", onclick: open }, "Show the house in 3-D");
    place.append(
      has3d(this.facts) ? button : h("p", { class: "note" }, "This file does not hold the model of this house."),
    );
    return h(
      "section",
      { class: "house3d", "aria-labelledby": "house-title" },
      h("h2", { id: "house-title" }, "House"),
      place,
      h("p", { class: "note" }, "Drag to turn, wheel or pinch to come nearer, right button to shift. Near walls are left out."),
    );
  }

  setPrivileged(on) {
    privileged = on;
    this.toggle.checked = on;
    this.element.classList.toggle("shows-privileged", on);
    this.map.setPrivileged(on);
    for (const card of this.cards) {
      card.setPrivileged(on);
    }
  }

  async readNeighbours() {
    const query = new URLSearchParams(this.query);
    query.delete("page");
    const text = String(query) ? `?${query}` : "";
    try {
      this.near = await load(`${episodePath(this.facts)}/neighbours${text}`);
    } catch {
      return; // the page is good without
    }
    const link = (which, text_, label) =>
      this.near[which] === null
        ? h("span", { class: "off", "aria-hidden": "true" }, text_)
        : h("a", { href: this.hash(this.near[which]), "aria-label": label }, text_);
    const place = this.near.place === null ? "" : `${this.near.place + 1} of ${this.near.total.toLocaleString("en")}`;
    this.beside.replaceChildren(
      link("before", "←", "Previous episode"),
      h("span", {}, place),
      link("after", "→", "Next episode"),
    );
  }

  hash(episode) {
    return `#/episode/${episode.scene_id}/${episode.index}${String(this.query) ? `?${this.query}` : ""}`;
  }

  follow(which) {
    if (this.near?.[which]) {
      location.hash = this.hash(this.near[which]);
    }
  }

  onMap(event) {
    const number = Number(event.target.closest("[data-number]")?.dataset.number ?? 0);
    if (this.video !== null || this.player.playing || this.player.step > 0) {
      return;
    }
    for (const card of this.cards) {
      card.element.classList.toggle("chosen", card.obstacle.number === number);
    }
    if (number > 0) {
      this.cards[number - 1].preview();
    } else {
      this.map.reset();
    }
  }

  /** Clear what hovering drew, unless something is being played. */
  rest() {
    if (this.video === null && !this.player.playing && this.player.step === 0) {
      this.map.reset();
      this.map.highlight(0);
      for (const card of this.cards) {
        card.element.classList.remove("chosen");
      }
    }
  }

  /** Make room on the map for an outcome: the expert goes back to its start. */
  takeMap() {
    this.stopVideo();
    if (this.player.ready && (this.player.playing || this.player.step > 0)) {
      this.player.pause();
      this.player.go(0, false);
    }
    this.map.clearAgent();
  }

  startVideo(card, outcome) {
    this.takeMap();
    this.video = new Video(this, card, outcome);
    this.video.start();
  }

  stopVideo() {
    this.video?.stop();
    this.video = null;
  }
}

class ObstacleCard {
  constructor(page, obstacle) {
    this.page = page;
    this.obstacle = obstacle;
    this.text = h("p", { class: "told", "aria-live": "polite" });
    this.hidden = h("dl", { class: "hidden" });
    this.kind = chip("", "");
    this.screen = h("div", { class: "screen small" });
    this.screen.hidden = true;
    this.element = h(
      "div",
      { class: "obstaclecard", role: "group", "aria-label": `Obstacle ${obstacle.number}, ${obstacle.type}` },
      h("h3", {}, h("span", { class: "number" }, obstacle.number), obstacle.type, this.kind),
      obstacle.outcomes === null ? h("p", { class: "note" }, "No outcomes are stored.") : this.pad(),
      h("div", { class: "words" }, this.text, this.hidden),
      this.screen,
    );
    this.element.addEventListener("pointerenter", () => this.page.video === null && this.page.map.highlight(obstacle.number));
    this.element.addEventListener("pointerleave", () => this.page.rest());
    this.say();
  }

  pad() {
    const known = new Map(this.obstacle.outcomes.map((outcome) => [outcome.action, outcome]));
    return h(
      "div",
      { class: "pad" },
      PAD.map(([action, text, place]) => {
        const outcome = known.get(action);
        if (outcome === undefined) {
          return null;
        }
        const kind = !outcome.success ? "fails" : outcome.opened ? "opens" : "moves";
        const button = h(
          "button",
          { type: "button", class: `${place} ${kind}`, "aria-label": outcome.text, "data-action": action },
          text,
        );
        button.addEventListener("pointerenter", () => this.show(outcome));
        button.addEventListener("focus", () => this.show(outcome));
        button.addEventListener("click", () => this.press(outcome));
        return button;
      }),
    );
  }

  /** Say how many outcomes move it, and open the way. */
  say() {
    const outcomes = this.obstacle.outcomes ?? [];
    const moves = outcomes.filter((outcome) => outcome.success).length;
    const opens = outcomes.filter((outcome) => outcome.opened).length;
    this.text.textContent = outcomes.length
      ? `${moves} of ${outcomes.length} interactions work${opens ? `, ${opens} open${opens === 1 ? "s" : ""} the path` : ""}.`
      : "";
  }

  preview() {
    this.page.map.showOutcomes(this.obstacle, this.obstacle.outcomes ?? []);
  }

  show(outcome) {
    if (this.page.video !== null) {
      return;
    }
    if (this.page.player.playing || this.page.player.step > 0) {
      this.page.takeMap();
    }
    this.text.textContent = outcome.text;
    this.page.map.showOutcomes(this.obstacle, [outcome]);
  }

  press(outcome) {
    this.text.textContent = outcome.text;
    if (outcome.video) {
      this.page.startVideo(this, outcome);
    }
  }

  setPrivileged(on) {
    const { privileged: known, kind } = this.obstacle;
    const shown = on ? known.kind : kind;
    this.kind.textContent = { push: "to push", pick: "to pick up", fixed: "fixed" }[shown];
    this.kind.className = `chip kind ${shown}`;
    const yes = (value) => (value === null ? "not stated" : value ? "yes" : "no");
    const pairs = [
      ["mass", `${figure(known.mass_kg)} kg`], ["friction", figure(known.friction)],
      ["pushable", yes(known.pushable)], ["pickable", yes(known.pickable)],
      ["movable", yes(known.movable)], ["relevant", yes(known.relevant)],
    ];
    this.hidden.replaceChildren(
      ...(on ? pairs.map(([name, value]) => h("div", {}, h("dt", {}, name), h("dd", {}, value))) : []),
    );
  }
}

/** Video of an outcome: keyframes on the map, a camera nearby beside its card. */
class Video {
  constructor(page, card, outcome) {
    this.page = page;
    this.card = card;
    this.path = `${episodePath(page.facts)}/obstacle/${card.obstacle.number}/${outcome.action}`;
    this.outcome = outcome;
    this.stopped = false;
  }

  async start() {
    const { map } = this.page;
    const image = h("img", { alt: `The outcome seen by a camera nearby: ${this.outcome.text}`, width: 320, height: 320 });
    this.card.element.classList.add("rolling");
    if (!has(this.path)) {
      this.page.map.showOutcomes(this.card.obstacle, [this.outcome]);
      this.page.video = null;
      return;
    }
    try {
      const { objects, frames } = await load(this.path);
      const pictures = frames.map((_, k) => `${this.path}/${k}`).filter((url) => has(url));
      if (pictures.length === frames.length) {
        image.addEventListener("error", async () => image.replaceWith(failure(await reason(pictures[0]))));
        this.card.screen.hidden = false;
        this.card.screen.replaceChildren(image);
        await Promise.all(pictures.map((url) => fetched(source(url))));
      }
      const first = calm() ? frames.length - 1 : 0;
      for (let k = first; k < frames.length && !this.stopped; k += 1) {
        map.drawFrame(objects, frames[k]);
        map.drawGhosts(objects, frames[0]);
        map.highlight(this.card.obstacle.number);
        if (pictures.length === frames.length) {
          image.src = source(pictures[k]);
          await image.decode().catch(() => {});
        }
        await new Promise((done) => setTimeout(done, k === 0 ? 5 * FRAME_MS : FRAME_MS));
      }
    } catch (error) {
      this.card.screen.hidden = false;
      this.card.screen.replaceChildren(failure(error.message));
    }
    if (!this.stopped) {
      map.showOutcomes(this.card.obstacle, [this.outcome]);
      this.page.video = null;
    }
  }

  stop() {
    this.stopped = true;
    this.card.element.classList.remove("rolling");
  }
}

/** Load a picture, so that it is there when its turn comes; a failure shows itself later. */
function fetched(url) {
  const image = new Image();
  image.src = url;
  return image.decode().catch(() => {});
}
