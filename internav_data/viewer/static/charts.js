// Bar charts as SVG.

import { s } from "viewer/dom";

const WIDTH = 440;
const HEIGHT = 210;
const [LEFT, RIGHT, TOP, BOTTOM] = [44, 10, 34, 34];

/** Bars beside each other: `series` are {name, values, colour}, one value a label. */
export function bars({ title, labels, series, format = String, unit = "" }) {
  const most = Math.max(1e-9, ...series.flatMap((each) => each.values));
  const ticks = round(most);
  const y = (value) => HEIGHT - BOTTOM - (value / ticks.at(-1)) * (HEIGHT - TOP - BOTTOM);
  const slot = (WIDTH - LEFT - RIGHT) / labels.length;
  const wide = Math.min(34, (slot * 0.78) / series.length);
  const every = Math.ceil(labels.length / 14);
  return chart(
    title,
    labels.map((label, k) => `${label}: ${series.map((each) => `${each.name} ${format(each.values[k])}`).join(", ")}`),
    ticks.map((tick) => [
      s("path", { d: `M${LEFT} ${y(tick)}H${WIDTH - RIGHT}`, class: "grid" }),
      s("text", { x: LEFT - 6, y: y(tick) + 4, class: "end" }, format(tick)),
    ]),
    labels.map((label, k) => {
      const middle = LEFT + slot * (k + 0.5);
      return [
        k % every === 0 ? s("text", { x: middle, y: HEIGHT - BOTTOM + 16, class: "mid" }, label) : null,
        series.map((each, n) =>
          s(
            "rect",
            {
              x: middle + wide * (n - series.length / 2) + 0.5,
              y: y(each.values[k]),
              width: Math.max(1, wide - 1),
              height: Math.max(0, HEIGHT - BOTTOM - y(each.values[k])),
              fill: each.colour,
            },
            s("title", {}, `${label}: ${each.name ? `${each.name} ` : ""}${format(each.values[k])}${unit}`),
          ),
        ),
      ];
    }),
    series.length > 1 ? legend(series) : null,
    unit ? s("text", { x: WIDTH - RIGHT, y: HEIGHT - 3, class: "end" }, unit.trim()) : null,
  );
}

function legend(series) {
  let x = WIDTH - RIGHT;
  return series.toReversed().map((each) => {
    x -= 18 + each.name.length * 6.4;
    return [
      s("rect", { x, y: 7, width: 10, height: 10, fill: each.colour }),
      s("text", { x: x + 14, y: 16 }, each.name),
    ];
  });
}

/** Bars below each other, with their values written beside them. */
export function rows({ title, entries, format = String, colour = "var(--series-1)" }) {
  const most = Math.max(1e-9, ...entries.map(([, value]) => value));
  const each = 20;
  const left = 8 + Math.max(...entries.map(([label]) => label.length), 4) * 6.3;
  const room = WIDTH - left - 58;
  return chart(
    title,
    entries.map(([label, value]) => `${label} ${format(value)}`),
    entries.map(([label, value], k) => {
      const top = TOP + each * k;
      return [
        s("text", { x: left - 6, y: top + 13, class: "end" }, label),
        s("rect", { x: left, y: top + 3, width: Math.max(1, (value / most) * room), height: each - 7, fill: colour }),
        s("text", { x: left + (value / most) * room + 6, y: top + 13 }, format(value)),
      ];
    }),
    TOP + each * entries.length + 6,
  );
}

function chart(title, spoken, ...parts) {
  const height = typeof parts.at(-1) === "number" ? parts.pop() : HEIGHT;
  return s(
    "svg",
    { viewBox: `0 0 ${WIDTH} ${height}`, class: "chart", role: "img", "aria-label": `${title}. ${spoken.join("; ")}` },
    s("text", { x: 4, y: 17, class: "name" }, title),
    parts,
  );
}

/** Round ticks from 0, four steps at most, to the first that is not below a value. */
function round(most) {
  const power = 10 ** Math.floor(Math.log10(most / 4));
  const step = [1, 2, 2.5, 5, 10].map((k) => k * power).find((k) => k * 4 >= most * 0.999);
  return Array.from({ length: Math.ceil((most * 0.999) / step) + 1 }, (_, k) => k * step);
}
