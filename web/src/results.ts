/** What a run came to: figures, plots, film, config, versions; of several runs a table. */
import { type PageData, type PictureData, type RunData, unzipped } from "./data";
import { make, pairs, section } from "./dom";

/** Return the sections of what a run came to. */
export function resultsOf(run: RunData): HTMLElement[] {
  const figures = run.pictures.map(figureOf);
  const parts: HTMLElement[] = [];
  if (figures.length > 0) parts.push(section("plots", "How it learned, and what it knows", make("div", { class: "figures" }, ...figures)));
  const column = make("div", { class: "column" });
  if (run.facts.length > 0) column.append(section("facts", "What it came to", tiles(run.facts)));
  if (run.config.length > 0)
    column.append(section("config", "How it was trained", folded("All settings", run.config), folded("Versions", run.versions)));
  if (column.children.length > 0) parts.push(column);
  if (run.film) parts.push(section("film", "The film", filmOf(run)));
  return parts;
}

/** Return a plot, as an image: an SVG in an image runs no script and loads nothing. */
function figureOf({ title, alt, svg }: PictureData): HTMLElement {
  const image = make("img", { alt });
  void unzipped(svg).then((content) => {
    image.src = `data:image/svg+xml,${encodeURIComponent(new TextDecoder().decode(content))}`;
  });
  return make("figure", {}, make("h3", {}, title), image);
}

function tiles(facts: [string, string][]): HTMLElement {
  return make("dl", { class: "tiles" }, ...facts.map(([name, value]) => make("div", {}, make("dt", {}, name), make("dd", {}, value))));
}

function folded(title: string, rows: [string, string][]): HTMLElement {
  return make("details", {}, make("summary", {}, title), pairs(rows));
}

function filmOf(run: RunData): HTMLElement {
  const source = run.film ?? "";
  const label = `The film of ${run.name}`;
  if (source.startsWith("data:image")) return make("img", { src: source, alt: label });
  return make("video", { src: source, controls: true, playsinline: true, loop: true, muted: true, preload: "auto", "aria-label": label });
}

/** Return a table of several runs, each with a button that shows it. */
export function runsTable(data: PageData, show: (index: number) => void): HTMLElement {
  const names = [...new Set(data.runs.flatMap(({ facts }) => facts.map(([name]) => name)))];
  const head = make("tr", {}, make("th", { scope: "col" }, "Run"), ...names.map((name) => make("th", { scope: "col" }, name)));
  const rows = data.runs.map((run, index) => {
    const facts = new Map(run.facts);
    const link = make("button", { type: "button", class: "link", click: () => show(index) }, run.name);
    return make("tr", {}, make("th", { scope: "row" }, link), ...names.map((name) => make("td", {}, facts.get(name) ?? "–")));
  });
  return section("runs", "The runs", make("div", { class: "wide" }, make("table", {}, make("thead", {}, head), make("tbody", {}, ...rows))));
}

/** Return what the page is made of, and under which licences. */
export function creditsOf(data: PageData): HTMLElement {
  const list: [string, string][] = [
    [`mjcartpole ${data.version}`, "MIT"],
    ["MuJoCo, © DeepMind Technologies Limited", "Apache-2.0"],
    ["three.js, © three.js authors", "MIT"],
  ];
  return make("footer", {}, make("p", {}, "This page is one file and loads nothing. It contains: ",
    list.map(([name, licence]) => `${name} (${licence})`).join("; "), "."), make("p", {}, "Plots: matplotlib, in SVG."));
}
