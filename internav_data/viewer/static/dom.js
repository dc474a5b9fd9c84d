// Elements in one expression, and pictures that say what is wrong where they would be.

import { reason, source } from "viewer/data";

const SVG = "http://www.w3.org/2000/svg";

/** An HTML element: attributes, listeners as `onclick`, then children (null is left out). */
export function h(tag, attributes = {}, ...children) {
  return filled(document.createElement(tag), attributes, children);
}

/** An SVG element, likewise. */
export function s(tag, attributes = {}, ...children) {
  return filled(document.createElementNS(SVG, tag), attributes, children);
}

function filled(node, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) {
      node.addEventListener(name.slice(2), value);
    } else if (value === true) {
      node.setAttribute(name, "");
    } else if (value !== false && value !== null && value !== undefined) {
      node.setAttribute(name, value);
    }
  }
  node.append(...children.flat(Infinity).filter((child) => child !== null && child !== undefined));
  return node;
}

/** A line that says what is wrong. */
export function failure(text) {
  return h("p", { class: "failure", role: "alert" }, text);
}

/** A picture at an address of the page's; what is wrong with it stands in its place. */
export function picture(url, alt, attributes = {}) {
  const address = source(url);
  if (address === null) {
    return failure("this file does not hold the picture");
  }
  const image = h("img", { alt, decoding: "async", ...attributes });
  image.addEventListener("error", async () => image.replaceWith(failure(await reason(url))));
  image.src = address;
  return image;
}

/** Whether the user asked for less motion. */
export function calm() {
  return matchMedia("(prefers-reduced-motion: reduce)").matches;
}

/** A number with few digits, or a dash. */
export function figure(value, digits = 2, unit = "") {
  return value === null || value === undefined ? "—" : `${Number(value).toFixed(digits)}${unit}`;
}

/** A count with thin spaces between thousands. */
export function count(value) {
  return value.toLocaleString("en").replaceAll(",", "\u202f");
}

/** A count of things: "1 room", "3 rooms". */
export function some(value, word) {
  return `${count(value)} ${word}${value === 1 ? "" : "s"}`;
}

export function chip(text, kind) {
  return h("span", { class: `chip ${kind ?? ""}` }, text);
}

const ICONS = {
  play: "M6 3.5v13l11-6.5z",
  pause: "M5 3.5h3.6v13H5zM11.4 3.5H15v13h-3.6z",
  first: "M4 4h2v12H4zM16 4v12l-9-6z",
  last: "M14 4h2v12h-2zM4 4v12l9-6z",
  back: "M13.5 4v12L5 10z",
  ahead: "M6.5 4v12l8.5-6z",
};

/** A small picture on a button. */
export function icon(name) {
  return s("svg", { viewBox: "0 0 20 20", class: "icon", "aria-hidden": "true" }, s("path", { d: ICONS[name] }));
}
