// The page's frame: addresses after #, navigation, keys.

import { embedded, keepPictures, load } from "viewer/data";
import { failure, h, some } from "viewer/dom";
import { showEpisode } from "viewer/episode";
import { showGallery } from "viewer/gallery";
import { showStatistics } from "viewer/statistics";

const main = document.getElementById("main");
let dataset = null;
let shown = { keys: {} };
let turn = 0;

/** Start the page: once the document is there. */
export async function start() {
  document.getElementById("help").addEventListener("click", showKeys);
  document.addEventListener("keydown", onKey);
  try {
    dataset = await load("/api/dataset");
  } catch (error) {
    main.replaceChildren(failure(error.message));
    return;
  }
  keepPictures(dataset.version);
  document.title = `${dataset.name} · internav-data`;
  document.getElementById("name").textContent = dataset.name;
  document.getElementById("size").textContent = embedded
    ? `a sample of ${some(dataset.episodes, "episode")}`
    : `${some(dataset.episodes, "episode")} in ${some(dataset.scenes, "house")}`;
  addEventListener("hashchange", route);
  await route();
}

/** Page, parts of its path, and query that the address names. */
function address() {
  const [path, text] = location.hash.replace(/^#\/?/, "").split("?");
  const parts = path.split("/").filter(Boolean).map(decodeURIComponent);
  return { page: parts[0] ?? "episodes", parts: parts.slice(1), query: new URLSearchParams(text ?? "") };
}

const PAGES = { episodes: showGallery, episode: showEpisode, statistics: showStatistics };

async function route() {
  if (location.hash === "#main") {
    main.focus();
    return;
  }
  const { page, parts, query } = address();
  for (const link of document.querySelectorAll("nav a")) {
    const current = link.dataset.page === (page === "episode" ? "episodes" : page);
    current ? link.setAttribute("aria-current", "page") : link.removeAttribute("aria-current");
  }
  const own = (turn += 1);
  const stays = shown.page === "episodes" && page === "episodes";
  shown.leave?.();
  if (!stays) {
    shown = { page, keys: {} };
    main.replaceChildren(h("p", { class: "wait", role: "status" }, "Loading …"));
    scrollTo(0, 0);
  }
  const context = { dataset, parts, query, current: () => own === turn };
  try {
    const view = await (PAGES[page] ?? unknown)(context, stays ? shown.view : null);
    if (own !== turn) {
      view.leave?.();
      return;
    }
    shown = { page, keys: view.keys ?? {}, leave: view.leave, view: view.view };
    if (!main.contains(view.element)) {
      main.replaceChildren(view.element);
    }
  } catch (error) {
    if (own === turn) {
      shown = { page, keys: {} };
      main.replaceChildren(
        failure(error.message),
        h("p", {}, h("a", { href: "#/episodes" }, "All episodes")),
      );
    }
  }
}

async function unknown() {
  throw new Error(`there is no page ${location.hash}`);
}

function showKeys() {
  document.getElementById("keys").showModal();
}

const GLOBAL = {
  "?": showKeys,
  g: () => (location.hash = "#/episodes"),
  s: () => (location.hash = "#/statistics"),
};

function onKey(event) {
  const target = event.target;
  if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) {
    return;
  }
  if (target.matches("input:not([type=checkbox]):not([type=range]), select, textarea")) {
    return;
  }
  // Space presses a button and toggles a switch; arrows move a slider by themselves.
  if (event.key === " " && target.closest("button, input, summary, a")) {
    return;
  }
  if (target.matches("input[type=range]") && event.key !== "?") {
    return;
  }
  const act = shown.keys[event.key] ?? GLOBAL[event.key];
  if (act !== undefined) {
    event.preventDefault();
    act();
  }
}
