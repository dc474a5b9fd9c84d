// Answers to the page's questions: from the server, or from the page itself where it is a file.

const element = document.getElementById("embedded");
const answers = element === null ? null : JSON.parse(element.textContent);

/** Whether the page is a file, with a sample of the episodes inside. */
export const embedded = answers !== null;

let version = "";

/** Let pictures be kept by the browser as long as the dataset is the same. */
export function keepPictures(text) {
  version = text;
}

/** Address of an episode's answers. */
export function episodePath(episode) {
  return `/api/episode/${encodeURIComponent(episode.scene_id)}/${episode.index}`;
}

/** JSON at an address; throws an Error whose message says what is wrong. */
export async function load(url) {
  if (embedded) {
    return fromFile(url);
  }
  let response;
  try {
    response = await fetch(url);
  } catch {
    throw new Error("the server does not answer: it was ended, or the connection broke");
  }
  const answer = await response.json();
  if (!response.ok) {
    throw new Error(answer.error ?? `the server answers ${response.status}`);
  }
  return answer;
}

/** Address of a picture for an <img>; null where a file does not hold it. */
export function source(url) {
  if (embedded) {
    return answers[url] ?? null;
  }
  return version ? `${url}?v=${version}` : url;
}

/** Whether an address is answered: a server answers all, a file those of its sample. */
export function has(url) {
  return !embedded || url in answers;
}

/** Why a picture is missing, in a line. */
export async function reason(url) {
  try {
    if (embedded) {
      return `this file does not hold ${url}`;
    }
    const response = await fetch(url);
    return response.ok ? "the picture cannot be shown" : (await response.json()).error;
  } catch {
    return "the server does not answer: it was ended, or the connection broke";
  }
}

/** Page of the 3-D viewer for an <iframe>: an address, or the page itself. */
export async function show3d(frame, episode) {
  if (!embedded) {
    frame.src = episodePath(episode).replace("/api/", "/view3d/");
    return;
  }
  const { page, mark } = answers["/view3d"];
  const packed = Uint8Array.from(atob(answers[`${episodePath(episode)}/model`]), (c) => c.charCodeAt(0));
  const plain = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const bytes = new Uint8Array(await new Response(plain).arrayBuffer());
  let text = "";
  for (let k = 0; k < bytes.length; k += 0x8000) {
    text += String.fromCharCode(...bytes.subarray(k, k + 0x8000));
  }
  frame.srcdoc = page.replace(mark, btoa(text));
}

export function has3d(episode) {
  return !embedded || `${episodePath(episode)}/model` in answers;
}

function fromFile(url) {
  const [path, text] = url.split("?");
  const query = new URLSearchParams(text ?? "");
  if (path === "/api/episodes") {
    return filtered(query);
  }
  if (path.endsWith("/neighbours")) {
    return neighbours(path, query);
  }
  if (!(path in answers)) {
    throw new Error(`this file holds a sample of the dataset, without ${path}`);
  }
  return answers[path];
}

const CONDITIONS = {
  rooms: (episode, words) => words.includes(String(episode.rooms)),
  mode: (episode, words) => words.includes(episode.mode),
  sealed: (episode, words) => words.includes(episode.sealed ? "yes" : "no"),
  split: (episode, words) => words.includes(episode.split),
  types: (episode, words) => episode.types.some((type) => words.includes(type)),
  obstacles: (episode, words) => within(episode.obstacles, words[0]),
  distance: (episode, words) => within(episode.distance, words[0]),
};

function within(value, range) {
  const [low, high] = range.includes("-") ? range.split("-") : [range, range];
  return value >= Number(low || 0) && value <= (high === "" ? Infinity : Number(high));
}

function chosen(query, except = null) {
  return answers["/api/episodes"].filter((episode) =>
    Object.entries(CONDITIONS).every(
      ([key, holds]) => key === except || !query.get(key) || holds(episode, query.get(key).split(",")),
    ),
  );
}

const VALUES = {
  rooms: (episode) => [episode.rooms],
  mode: (episode) => [episode.mode],
  sealed: (episode) => [episode.sealed ? "yes" : "no"],
  split: (episode) => [episode.split],
  obstacles: (episode) => [episode.obstacles],
  distance: (episode) => [Math.floor(episode.distance)],
  types: (episode) => episode.types,
};

function filtered(query) {
  const kept = ordered(chosen(query), query.get("order"));
  const offset = Number(query.get("offset") ?? 0);
  const limit = Number(query.get("limit") ?? 24);
  const counts = {};
  for (const [key, values] of Object.entries(VALUES)) {
    counts[key] = {};
    for (const value of answers["/api/episodes"].flatMap(values)) {
      counts[key][value] = 0;
    }
    for (const value of chosen(query, key).flatMap(values)) {
      counts[key][value] += 1;
    }
  }
  return { total: kept.length, offset, episodes: kept.slice(offset, offset + limit), counts };
}

function ordered(episodes, order) {
  if (order === "longest") {
    return episodes.toSorted((a, b) => b.distance - a.distance);
  }
  return order === "obstacles" ? episodes.toSorted((a, b) => b.obstacles - a.obstacles) : episodes;
}

function neighbours(path, query) {
  const kept = ordered(chosen(query), query.get("order"));
  const place = kept.findIndex((episode) => path === `${episodePath(episode)}/neighbours`);
  return {
    total: kept.length,
    place: place < 0 ? null : place,
    before: place < 0 ? null : (kept[place - 1] ?? null),
    after: kept[place + 1] ?? null,
  };
}
