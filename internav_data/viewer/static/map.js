// Map of an episode: the floor as a picture, all that moves as shapes in metres above it.

import { episodePath, reason, source } from "viewer/data";
import { failure, h, s } from "viewer/dom";

const COLOURS = { push: [255, 211, 38], pick: [255, 238, 130], fixed: [228, 150, 20] };
const RIM = "#302408";

/** Points x, y, x, y … of a polygon; y points up in the dataset, down on a screen. */
function points(flat) {
  const pairs = [];
  for (let k = 0; k < flat.length; k += 2) {
    pairs.push(`${flat[k]},${-flat[k + 1]}`);
  }
  return pairs.join(" ");
}

function shaded(colour, shade) {
  const [r, g, b] = colour.map((value) => Math.round(Math.min(255, value * Math.min(1, shade))));
  return `rgb(${r},${g},${b})`;
}

function rgb(hex) {
  return [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
}

export class EpisodeMap {
  constructor(facts) {
    this.facts = facts;
    const [x0, y0, x1, y1] = facts.box;
    this.unit = Math.max(x1 - x0, y1 - y0) / 100;
    const url = `${episodePath(facts)}/floor`;
    const layers = ["path", "ghosts", "objects", "effects", "ends", "trail", "agent", "badges"];
    this.layers = Object.fromEntries(layers.map((name) => [name, s("g", { class: name })]));
    this.svg = s(
      "svg",
      {
        viewBox: `${x0} ${-y1} ${x1 - x0} ${y1 - y0}`,
        class: "map",
        role: "img",
        "aria-label": `Map of ${facts.episode_id}: ${facts.room_path.join(", then ")}`,
      },
      s("image", { href: source(url), x: x0, y: -y1, width: x1 - x0, height: y1 - y0, onerror: () => this.fail(url) }),
      Object.values(this.layers),
    );
    this.element = h("div", { class: "mapframe" }, this.svg);
    this.privileged = false;
    this.placed = new Map();
    this.drawPath();
    this.drawEnds();
    this.reset();
  }

  async fail(url) {
    this.element.append(failure(await reason(url)));
  }

  /** Colour of an obstacle: what it looks as if one could do with it, or what one can. */
  colour(obstacle) {
    return COLOURS[this.privileged ? obstacle.privileged.kind : obstacle.kind];
  }

  setPrivileged(on) {
    this.privileged = on;
    this.drawObjects();
  }

  drawPath() {
    const { node_path: path } = this.facts;
    this.layers.path.replaceChildren(
      s("polyline", {
        points: points(path.flat()),
        class: "nodepath",
        "stroke-width": this.unit * 0.3,
        "stroke-dasharray": `${this.unit * 1.1} ${this.unit * 0.8}`,
      }),
    );
  }

  drawEnds() {
    const { start, goal, agent_radius_m: radius } = this.facts;
    const arrow = [0.34, 0, -0.1, 0.13, -0.04, 0, -0.1, -0.13];
    const line = this.unit * 0.2;
    this.layers.ends.replaceChildren(
      s(
        "g",
        { transform: `translate(${start.x},${-start.y})` },
        s("title", {}, "start"),
        s("circle", { r: radius, class: "start", "stroke-width": line }),
        s("polygon", { points: points(arrow), class: "heading", transform: `rotate(${-start.yaw_deg})` }),
      ),
      s(
        "g",
        { transform: `translate(${goal.x},${-goal.y})` },
        s("title", {}, "goal"),
        s("circle", { r: radius, class: "goal", "stroke-width": line }),
        s("circle", { r: radius * 0.62, class: "goalring", "stroke-width": line }),
        s("circle", { r: radius * 0.3, class: "goalmiddle" }),
      ),
    );
  }

  /** Put every obstacle where the episode starts, and clear what was drawn about outcomes. */
  reset() {
    this.placed.clear();
    this.layers.ghosts.replaceChildren();
    this.layers.effects.replaceChildren();
    this.drawObjects();
  }

  /** Parts of an obstacle as it is shown now; null where it is held. */
  partsOf(obstacle) {
    const moved = this.placed.get(obstacle.number);
    return moved === undefined ? obstacle.parts : moved;
  }

  drawObjects() {
    const groups = [];
    const badges = [];
    for (const obstacle of this.facts.obstacles) {
      const parts = this.partsOf(obstacle);
      if (parts === null) {
        continue;
      }
      groups.push(this.shape(parts, this.colour(obstacle), obstacle));
      badges.push(this.badge(obstacle, parts));
    }
    this.layers.objects.replaceChildren(...groups);
    this.layers.badges.replaceChildren(...badges);
  }

  shape(parts, colour, obstacle = null) {
    const kind = obstacle === null ? "" : this.privileged ? obstacle.privileged.kind : obstacle.kind;
    const rim = this.unit * 0.28;
    return s(
      "g",
      { class: `obstacle ${kind}`, "data-number": obstacle?.number },
      parts.map((part) => s("polygon", { points: points(part.points), stroke: RIM, "stroke-width": rim, class: "rim" })),
      parts.map((part) =>
        s("polygon", {
          points: points(part.points),
          fill: shaded(colour ?? rgb(part.colour), 0.55 + 0.45 * part.shade),
          stroke: shaded(colour ?? rgb(part.colour), 0.6),
          "stroke-width": this.unit * 0.07,
        }),
      ),
    );
  }

  badge(obstacle, parts) {
    const [x, y, size] = middle(parts);
    const radius = Math.max(this.unit * 1.15, 0.1);
    const off = size < 3 * radius ? radius * 1.5 : 0;
    return s(
      "g",
      { transform: `translate(${x + off},${-y - off})`, class: "badge", "data-number": obstacle.number },
      s("circle", { r: radius, "stroke-width": radius * 0.14, style: `stroke:${shaded(this.colour(obstacle), 1)}` }),
      s("text", { "font-size": radius * 1.25, dy: radius * 0.44 }, String(obstacle.number)),
    );
  }

  highlight(number) {
    for (const node of this.svg.querySelectorAll("[data-number]")) {
      node.classList.toggle("chosen", Number(node.dataset.number) === number);
    }
  }

  /** Show where an outcome puts an obstacle, and what it takes along; or all of its outcomes. */
  showOutcomes(obstacle, outcomes) {
    this.placed.clear();
    const ghosts = [];
    const effects = [];
    const one = outcomes.length === 1;
    for (const outcome of outcomes.filter((each) => each.video)) {
      const kind = outcome.opened ? "opens" : "moves";
      if (outcome.parts !== null) {
        effects.push(this.effect(outcome.parts, one ? this.colour(obstacle) : null, `after ${kind}`));
        effects.push(this.arrow(obstacle.at, outcome.at, kind));
      }
      for (const other of one ? outcome.moved : []) {
        ghosts.push(outline(other.before, this.unit));
        effects.push(this.effect(other.parts, rgb(other.parts[0]?.colour ?? "#888888"), "after along"));
        effects.push(this.arrow(other.from, other.at, "along"));
        if (other.obstacle !== null) {
          this.placed.set(other.obstacle, null);
        }
      }
      if (one) {
        ghosts.push(outline(obstacle.parts, this.unit));
        this.placed.set(obstacle.number, null);
      }
    }
    this.layers.ghosts.replaceChildren(...ghosts);
    this.layers.effects.replaceChildren(...effects);
    this.drawObjects();
    this.highlight(obstacle.number);
  }

  effect(parts, colour, kind) {
    return s(
      "g",
      { class: kind },
      parts.map((part) =>
        s("polygon", {
          points: points(part.points),
          "stroke-width": this.unit * 0.22,
          style: colour === null ? null : `fill:${shaded(colour, 0.55 + 0.45 * part.shade)}`,
        }),
      ),
    );
  }

  arrow(from, to, kind) {
    const far = Math.hypot(to[0] - from[0], to[1] - from[1]);
    if (far < 0.08) {
      return null;
    }
    const turn = Math.atan2(to[1] - from[1], to[0] - from[0]);
    const head = Math.min(this.unit * 1.5, far * 0.6);
    return s(
      "g",
      { class: `arrow ${kind}`, transform: `translate(${from[0]},${-from[1]}) rotate(${(-turn * 180) / Math.PI})` },
      s("path", { d: `M0 0H${far - head * 0.7}`, "stroke-width": this.unit * 0.34 }),
      s("polygon", { points: points([far, 0, far - head, head * 0.42, far - head, -head * 0.42]) }),
    );
  }

  /** Draw one picture of a video: parts of each moving object, null where it is held. */
  drawFrame(objects, frame) {
    this.placed.clear();
    const others = [];
    objects.forEach((object, k) => {
      if (object.obstacle !== null) {
        this.placed.set(object.obstacle, frame[k]);
      } else if (frame[k] !== null) {
        others.push(this.shape(frame[k], null));
      }
    });
    this.drawObjects();
    this.layers.effects.replaceChildren(...others);
  }

  /** Outline where objects stood first. */
  drawGhosts(objects, frame) {
    this.layers.ghosts.replaceChildren(
      ...objects.map((_, k) => (frame[k] === null ? null : outline(frame[k], this.unit))).filter(Boolean),
    );
  }

  /** Draw the agent at a moment of the expert, its trail, and objects that lie elsewhere by now. */
  drawMoment(play, step) {
    const moment = play.moments[step];
    this.placed.clear();
    const ghosts = [];
    const others = [];
    for (const [item, parts] of Object.entries(moment.moved)) {
      const { obstacle } = play.objects[item];
      if (obstacle !== null) {
        this.placed.set(obstacle, parts);
        ghosts.push(outline(this.facts.obstacles[obstacle - 1].parts, this.unit));
      } else if (parts !== null) {
        others.push(this.shape(parts, null));
      }
    }
    this.drawObjects();
    this.layers.ghosts.replaceChildren(...ghosts);
    this.layers.effects.replaceChildren(...others);
    const target = moment.target >= 0 ? (play.objects[moment.target]?.obstacle ?? 0) : 0;
    this.highlight(target);
    this.drawTrail(play, step);
    this.drawAgent(moment);
  }

  drawTrail(play, step) {
    const trail = play.moments.slice(0, step + 1).flatMap((moment) => [moment.x, moment.y]);
    const line = { points: points(trail), "stroke-linejoin": "round", "stroke-linecap": "round" };
    this.layers.trail.replaceChildren(
      s("polyline", { ...line, class: "halo", "stroke-width": this.unit * 0.75 }),
      s("polyline", { ...line, class: "walked", "stroke-width": this.unit * 0.4 }),
    );
  }

  drawAgent(moment) {
    const radius = Math.max(this.facts.agent_radius_m, this.unit * 1.1);
    this.layers.agent.replaceChildren(
      s("polygon", { points: points(moment.cone), class: "cone" }),
      s(
        "g",
        { transform: `translate(${moment.x},${-moment.y}) rotate(${-moment.yaw_deg})` },
        s("circle", { r: radius, class: "body", "stroke-width": radius * 0.16 }),
        s("polygon", {
          points: points([0.8, 0, -0.5, 0.55, -0.2, 0, -0.5, -0.55].map((value) => value * radius)),
          class: "heading",
        }),
      ),
    );
  }

  clearAgent() {
    this.layers.agent.replaceChildren();
    this.layers.trail.replaceChildren();
  }
}

/** Dashed outline of an object where it was. */
function outline(parts, unit) {
  return s(
    "g",
    { class: "ghost" },
    s("polygon", {
      points: points(hull(parts.flatMap((part) => part.points))),
      "stroke-width": unit * 0.22,
      "stroke-dasharray": `${unit * 0.6} ${unit * 0.4}`,
    }),
  );
}

/** Convex hull of points x, y, x, y … (Andrew's monotone chain, 1979). */
function hull(flat) {
  const all = [];
  for (let k = 0; k < flat.length; k += 2) {
    all.push([flat[k], flat[k + 1]]);
  }
  all.sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (sorted) => {
    const chain = [];
    for (const p of sorted) {
      while (chain.length > 1 && cross(chain.at(-2), chain.at(-1), p) <= 0) {
        chain.pop();
      }
      chain.push(p);
    }
    return chain.slice(0, -1);
  };
  return [...half(all), ...half(all.toReversed())].flat();
}

function cross(o, a, b) {
  return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
}

function middle(parts) {
  const flat = parts.flatMap((part) => part.points);
  const xs = flat.filter((_, k) => k % 2 === 0);
  const ys = flat.filter((_, k) => k % 2 === 1);
  const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  return [(x0 + x1) / 2, (y0 + y1) / 2, Math.max(x1 - x0, y1 - y0)];
}
