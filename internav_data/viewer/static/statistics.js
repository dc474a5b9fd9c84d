// Statistics of the dataset, beside the paper's Table 2.

import { load } from "viewer/data";
import { bars, rows } from "viewer/charts";
import { count, figure, h } from "viewer/dom";

const OURS = "var(--series-1)";
const PAPER = "var(--paperbar)";
const COLUMNS = [
  ["ratio", "Share of the episodes", 3],
  ["obstacle_num", "Obstacles", 2],
  ["distance_m", "Distance, m", 2],
  ["cross_room_num", "Rooms on the path", 2],
];
const percent = (value) => `${(100 * value).toFixed(value < 0.1 ? 1 : 0)} %`;
const short = (value) =>
  value >= 1e6 ? `${+(value / 1e6).toFixed(1)} M` : value >= 1e4 ? `${+(value / 1e3).toFixed(0)} k` : String(+value.toFixed(2));

export async function showStatistics({ dataset }) {
  const { stats, counts } = await load("/api/statistics");
  return {
    element: h(
      "article",
      { class: "statistics" },
      h("h1", {}, "Statistics"),
      tiles(dataset, stats),
      h("section", {}, h("h2", {}, "Beside Table 2 of the paper"), tableTwo(stats), paperCharts(stats)),
      h("section", {}, h("h2", {}, "Episodes"), h("div", { class: "charts packed" }, episodeCharts(counts))),
      h("section", {}, h("h2", {}, "Obstacles and outcomes"), h("div", { class: "charts packed" }, obstacleCharts(stats))),
      h("section", {}, h("h2", {}, "Expert and draws"), h("div", { class: "charts packed" }, expertCharts(stats))),
    ),
  };
}

function tiles(dataset, stats) {
  const shown = [
    [count(stats.episodes), "episodes"],
    [count(stats.scenes), "houses"],
    [percent(stats.modes.blocked / Math.max(1, stats.episodes)), "blocked"],
    [percent(stats.sealed_share_of_blocked), "of the blocked sealed"],
    [percent(stats.openable_share_of_blocked), "of the blocked open by one interaction"],
    [percent(stats.expert.solved_share), "with an expert"],
    [figure(stats.expert.spl), "SPL of the expert"],
    [stats.relevant_share === null ? "—" : percent(stats.relevant_share), "of the obstacles relevant"],
  ];
  return h(
    "dl",
    { class: "tiles" },
    shown.map(([value, name]) => h("div", {}, h("dt", {}, name), h("dd", {}, value))),
    h("div", {}, h("dt", {}, "made by"), h("dd", { class: "small" }, `${dataset.made_by}, seed ${dataset.seed}`)),
  );
}

function tableTwo(stats) {
  return h(
    "div",
    { class: "wide", tabindex: 0, role: "region", "aria-label": "Table 2" },
    h(
      "table",
      {},
      h(
        "thead",
        {},
        h("tr", {}, h("th", { scope: "col" }, "Rooms"), h("th", { scope: "col" }, "Houses"), h("th", { scope: "col" }, "Episodes"),
          COLUMNS.map(([, name]) => [h("th", { scope: "col" }, name), h("th", { scope: "col", class: "paper" }, "paper")])),
      ),
      h(
        "tbody",
        {},
        stats.table2.map((row) =>
          h(
            "tr",
            {},
            h("th", { scope: "row" }, row.rooms.replace("-", "–")),
            h("td", {}, count(row.scenes)),
            h("td", {}, count(row.episodes)),
            COLUMNS.map(([key, , digits]) => [
              h("td", {}, figure(row[key], digits)),
              h("td", { class: "paper" }, figure(row.paper[key], digits)),
            ]),
          ),
        ),
      ),
    ),
  );
}

function paperCharts(stats) {
  const labels = stats.table2.map((row) => `${row.rooms.replace("-", "–")} rooms`);
  return h(
    "div",
    { class: "charts" },
    COLUMNS.map(([key, title]) =>
      bars({
        title,
        labels,
        series: [
          { name: "dataset", values: stats.table2.map((row) => row[key]), colour: OURS },
          { name: "paper", values: stats.table2.map((row) => row.paper[key]), colour: PAPER },
        ],
        format: (value) => String(+value.toFixed(2)),
      }),
    ),
  );
}

function histogram(title, counted, step = 1) {
  const keys = Object.keys(counted).map(Number);
  if (keys.length === 0) {
    return null;
  }
  const [first, last] = [Math.min(...keys), Math.max(...keys)];
  const labels = [];
  for (let key = first; key <= last; key += step) {
    labels.push(key);
  }
  const values = labels.map((key) => counted[key] ?? 0);
  return bars({ title, labels, series: [{ name: "episodes", values, colour: OURS }], format: short });
}

function episodeCharts(counts) {
  return [
    histogram("Rooms of the house", counts.rooms),
    histogram("Obstacles", counts.obstacles),
    histogram("Distance without obstacles, m", counts.distance),
    rows({ title: "Splits", entries: Object.entries(counts.split), format: count }),
    rows({ title: "Modes", entries: Object.entries(counts.mode), format: count, colour: "var(--path)" }),
  ];
}

function obstacleCharts(stats) {
  const types = Object.entries(stats.obstacle_types).sort((a, b) => b[1] - a[1]);
  const outcomes = stats.outcomes.filter((row) => row.possible > 0);
  const words = (row) => row.action.replace("_", " ");
  return [
    rows({ title: "Obstacles by type", entries: types, format: count, colour: "var(--fixed)" }),
    rows({
      title: "Interactions that succeed, of those possible",
      entries: outcomes.map((row) => [words(row), row.success_share]), format: percent, colour: "var(--start)",
    }),
    rows({
      title: "Interactions that open a blocked path",
      entries: outcomes.map((row) => [words(row), row.opened]), format: count, colour: "var(--start)",
    }),
    rows({
      title: "Obstacles by what one can do",
      entries: [["pushable", stats.obstacles_pushable], ["pickable", stats.obstacles_pickable], ["fixed", stats.obstacles_fixed]],
      format: count, colour: "var(--push)",
    }),
  ];
}

function expertCharts(stats) {
  const interactions = Object.entries(stats.expert.interactions ?? {});
  const redraws = Object.entries(stats.redraws ?? {});
  return [
    interactions.length
      ? bars({
          title: "Interactions of an expert", labels: interactions.map(([number]) => number),
          series: [{ name: "experts", values: interactions.map(([, value]) => value), colour: "var(--agent)" }], format: short,
        })
      : null,
    redraws.length ? rows({ title: "Draws that were made again, by reason", entries: redraws, format: count, colour: "var(--series-6)" }) : null,
    spreads(stats),
  ];
}

function spreads(stats) {
  const shown = [
    ["shortest path, m", stats.shortest_path_m],
    ["shortest path, steps", stats.shortest_path_steps],
    ["detour of lengthened, steps", stats.detour_steps],
    ["expert, steps", stats.expert.steps],
  ];
  return h(
    "table",
    { class: "spreads" },
    h("thead", {}, h("tr", {}, ["", "min", "median", "mean", "max"].map((name) => h("th", { scope: "col" }, name)))),
    h(
      "tbody",
      {},
      shown.map(([name, spread]) =>
        h("tr", {}, h("th", { scope: "row" }, name), ["min", "median", "mean", "max"].map((key) => h("td", {}, figure(spread[key], 1)))),
      ),
    ),
  );
}
