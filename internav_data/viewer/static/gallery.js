// Gallery of episodes from above, filtered by what the address holds.

import { episodePath, load } from "viewer/data";
import { calm, chip, count, failure, figure, h, picture, some } from "viewer/dom";

const PAGE = 24;
const ORDERS = { stored: "as stored", longest: "longest path first", obstacles: "most obstacles first" };

/** Show the gallery; `old` is the view of the same page before, whose elements stay. */
export async function showGallery({ query, current }, old) {
  const view = old ?? new Gallery();
  await view.show(query, current);
  return {
    view,
    element: view.element,
    keys: { j: () => view.turn(1), k: () => view.turn(-1) },
  };
}

class Gallery {
  constructor() {
    this.query = new URLSearchParams();
    this.filters = h("form", { class: "filters", "aria-label": "Filters" });
    this.filters.addEventListener("submit", (event) => event.preventDefault());
    this.panel = h(
      "details",
      { class: "panel", open: innerWidth >= 900 },
      h("summary", {}, "Filters ", (this.active = h("span", { class: "active" }))),
      this.filters,
    );
    this.status = h("p", { class: "status", role: "status" });
    this.clear = h("a", { href: "#/episodes", class: "clear", hidden: true }, "Clear all filters");
    this.order = h(
      "select",
      { "aria-label": "Order", onchange: () => this.set("order", this.order.value) },
      Object.entries(ORDERS).map(([value, text]) => h("option", { value }, text)),
    );
    this.grid = h("ul", { class: "grid" });
    this.pages = h("nav", { class: "pages", "aria-label": "Pages of episodes" });
    this.element = h(
      "div",
      { class: "gallery" },
      h("h1", { class: "unseen" }, "Episodes"),
      h("aside", {}, this.panel),
      h(
        "section",
        { "aria-label": "Episodes" },
        h("div", { class: "bar" }, this.status, this.clear, this.order),
        this.grid,
        this.pages,
      ),
    );
  }

  async show(query, current) {
    this.query = query;
    const page = Math.max(1, Number(query.get("page") ?? 1) || 1);
    const asked = new URLSearchParams(query);
    asked.delete("page");
    const link = asked.toString();
    asked.set("offset", String((page - 1) * PAGE));
    asked.set("limit", String(PAGE));
    this.element.setAttribute("aria-busy", "true");
    let answer = null;
    try {
      answer = await load(`/api/episodes?${asked}`);
      if (!current()) {
        return;
      }
    } catch (error) {
      this.status.textContent = "";
      this.grid.replaceChildren(h("li", { class: "wide" }, failure(error.message)));
      this.pages.replaceChildren();
      this.clear.hidden = false;
      return;
    } finally {
      this.element.setAttribute("aria-busy", "false");
    }
    this.last = Math.max(1, Math.ceil(answer.total / PAGE));
    this.page = Math.min(page, this.last);
    this.paint(answer, link);
    if (answer.counts === null) {
      this.fill(asked, current);
    } else {
      this.paintFilters(answer.counts);
    }
  }

  /** Ask for the counts by value, which the server was still reading. */
  async fill(asked, current) {
    this.filters.replaceChildren(h("p", { class: "wait" }, "Reading the columns …"));
    asked.set("order", "stored");
    asked.set("obstacles", "0-");
    try {
      const { counts } = await load(`/api/episodes?${asked}`);
      if (current()) {
        this.paintFilters(counts);
      }
    } catch (error) {
      this.filters.replaceChildren(failure(error.message));
    }
  }

  paint(answer, link) {
    const first = answer.offset + 1;
    const end = answer.offset + answer.episodes.length;
    this.status.textContent =
      answer.total === 0
        ? "No episode meets all of these conditions."
        : `${some(answer.total, "episode")}${answer.total > PAGE ? `, ${count(first)}–${count(end)} shown` : ""}`;
    const conditions = [...this.query.keys()].filter((key) => !["page", "order"].includes(key));
    this.clear.hidden = conditions.length === 0;
    this.active.textContent = conditions.length ? `${conditions.length} set` : "";
    this.order.value = this.query.get("order") ?? "stored";
    this.grid.replaceChildren(...answer.episodes.map((episode) => card(episode, link)));
    this.paintPages();
  }

  paintPages() {
    if (this.last === 1) {
      this.pages.replaceChildren();
      return;
    }
    const link = (page, text, label) =>
      page >= 1 && page <= this.last
        ? h("a", { href: this.address(page), "aria-label": label }, text)
        : h("span", { class: "off", "aria-hidden": "true" }, text);
    this.pages.replaceChildren(
      link(this.page > 1 ? 1 : 0, "First", "First page"),
      link(this.page - 1, "← Previous", "Previous page"),
      h("span", { "aria-current": "page" }, `Page ${count(this.page)} of ${count(this.last)}`),
      link(this.page + 1, "Next →", "Next page"),
    );
  }

  address(page) {
    const query = new URLSearchParams(this.query);
    page === 1 ? query.delete("page") : query.set("page", String(page));
    return `#/episodes${String(query) ? `?${query}` : ""}`;
  }

  turn(by) {
    const page = this.page + by;
    if (page >= 1 && page <= this.last) {
      location.hash = this.address(page);
      scrollTo({ top: 0, behavior: calm() ? "auto" : "smooth" });
    }
  }

  set(key, value) {
    const query = new URLSearchParams(this.query);
    query.delete("page");
    value === "" || value === "stored" ? query.delete(key) : query.set(key, value);
    location.hash = `#/episodes${String(query) ? `?${query}` : ""}`;
  }

  paintFilters(counts) {
    const focused = document.activeElement?.id;
    this.filters.replaceChildren(
      this.choice("mode", "Mode", counts.mode),
      this.choice("sealed", "Sealed", counts.sealed, true),
      this.choice("split", "Split", counts.split),
      this.choice("rooms", "Rooms", counts.rooms),
      this.range("obstacles", "Obstacles", counts.obstacles, 1),
      this.range("distance", "Distance without obstacles, m", counts.distance, 0.5),
      this.choice("types", "Obstacle types, any of", counts.types),
    );
    if (focused) {
      document.getElementById(focused)?.focus();
    }
  }

  choice(key, title, counts, single = false) {
    const set = (this.query.get(key) ?? "").split(",").filter(Boolean);
    const values = [...new Set([...Object.keys(counts), ...set])];
    if (key === "rooms") {
      values.sort((a, b) => a - b);
    }
    const toggle = (value, on) => {
      const kept = single ? [] : set.filter((other) => other !== value);
      this.set(key, (on ? [...kept, value] : kept).join(","));
    };
    return h(
      "fieldset",
      { class: `choice ${key}` },
      h("legend", {}, title),
      values.map((value) => {
        const id = `filter-${key}-${value}`;
        return h(
          "label",
          { for: id, class: counts[value] ? "" : "none" },
          h("input", {
            type: "checkbox",
            id,
            checked: set.includes(value),
            onchange: (event) => toggle(value, event.target.checked),
          }),
          h("span", { class: "word" }, value),
          h("span", { class: "count" }, count(counts[value] ?? 0)),
        );
      }),
    );
  }

  range(key, title, counts, step) {
    const [low = "", high = ""] = (this.query.get(key) ?? "").split("-");
    const end = (name, value, label) =>
      h("input", {
        type: "number",
        id: `filter-${key}-${name}`,
        min: 0,
        step,
        value,
        placeholder: name,
        "aria-label": `${title}: ${label}`,
        onchange: () => this.set(key, this.read(key)),
      });
    return h(
      "fieldset",
      { class: "range" },
      h("legend", {}, title),
      spark(counts),
      h("div", {}, end("min", low, "least"), " – ", end("max", high, "greatest")),
    );
  }

  read(key) {
    const [low, high] = ["min", "max"].map((name) => document.getElementById(`filter-${key}-${name}`).value);
    return low === "" && high === "" ? "" : `${low}-${high}`;
  }
}

/** Small histogram of counts by whole number. */
function spark(counts) {
  const keys = Object.keys(counts).map(Number);
  if (keys.length === 0) {
    return null;
  }
  const [first, last] = [Math.min(...keys), Math.max(...keys)];
  const most = Math.max(1, ...Object.values(counts));
  const bars = [];
  for (let key = first; key <= last; key += 1) {
    const share = (counts[key] ?? 0) / most;
    bars.push(
      h("i", { style: `height:${Math.max(share * 100, share ? 4 : 0)}%`, title: `${key}: ${counts[key] ?? 0}` }),
    );
  }
  return h(
    "div",
    { class: "spark", "aria-hidden": "true" },
    h("div", { class: "bars" }, bars),
    h("div", { class: "ends" }, h("span", {}, first), h("span", {}, last)),
  );
}

function card(episode, link) {
  const name = `${episode.scene_id}/${String(episode.index).padStart(4, "0")}`;
  const facts = `${some(episode.rooms, "room")}, ${some(episode.obstacles, "obstacle")}, ${figure(episode.distance, 1)} m`;
  return h(
    "li",
    {},
    h(
      "a",
      {
        class: "card",
        href: `#/episode/${episode.scene_id}/${episode.index}${link ? `?${link}` : ""}`,
        title: episode.types.join(", "),
      },
      h("div", { class: "shot" }, picture(`${episodePath(episode)}/thumbnail`, "", { loading: "lazy" })),
      h(
        "div",
        { class: "about" },
        h("div", { class: "id" }, name),
        h("div", { class: "facts" }, facts),
        h(
          "div",
          { class: "chips" },
          chip(episode.mode, episode.mode),
          episode.sealed ? chip("sealed", "sealed") : null,
          episode.split === "train" ? null : chip(episode.split, "split"),
        ),
      ),
    ),
  );
}
