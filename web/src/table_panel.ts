/** The panel of the table: its slice, both values as they are, the state, and other starts. */
import { button, choice, make, section } from "./dom";
import { brief, quantities } from "./names";
import type { Play } from "./play";
import type { Policy } from "./policy";
import { Slice } from "./slice";

const SIDES = ["push left", "push right"];

/** Shows a policy at work. */
export class TablePanel {
  readonly element: HTMLElement;
  onStart: (state: number[]) => void = () => undefined;
  private readonly slice: Slice;
  private readonly bars = SIDES.map((side) => {
    const [value, bar] = [make("output"), make("i")];
    return { value, bar, row: make("div", { class: "value" }, make("span", {}, side), make("b", {}, bar), value) };
  });
  private readonly numbers: HTMLElement[];
  private readonly fields: HTMLInputElement[];
  private shownAt = 0;
  private range: [number, number] = [Infinity, -Infinity];

  constructor(
    private readonly policy: Policy,
    poles: number,
  ) {
    const names = quantities(poles);
    this.slice = new Slice(policy, names);
    this.slice.onStart = (state) => this.onStart(state);
    this.numbers = names.map(() => make("output"));
    const state = make("dl", { class: "state" },
      ...names.flatMap(({ symbol, name, unit }, i) => [make("dt", { title: name }, symbol), make("dd", {}, this.numbers[i], ` ${unit}`)]));
    this.fields = names.map(({ name, unit }) => make("input", { type: "number", step: "any", "aria-label": `${name}, ${unit}` }));
    const kind = policy.parts === 1 ? "one grid" : policy.grid.interpolated ? "nodes, with values in between" : `${policy.grid.tilings} grids, summed`;
    const size = policy.grid.bins.join(" × ");
    this.element = section("table", "What the table says",
      make("p", { class: "note" }, `${size}, ${kind}. Blue: push left is better; orange: push right. Click to start there.`),
      this.slice.canvas, this.axes(policy, names.map(({ symbol }) => symbol)),
      make("div", { class: "values" }, ...this.bars.map(({ row }) => row)), state, this.starts(names.map(({ symbol }) => symbol)));
  }

  /** Choices of which two values the slice is over, where there are more. */
  private axes(policy: Policy, symbols: string[]): HTMLElement {
    const used = policy.axes.map(({ dimension }) => dimension);
    const pairs = used.flatMap((a, i) => used.slice(i + 1).map((b): [string, string] => [`${a},${b}`, `${symbols[a]} and ${symbols[b]}`]));
    const picked = choice("Slice over", pairs, (value) => {
      const [a, b] = value.split(",").map(Number);
      this.slice.choose(a, b);
    });
    const select = picked.querySelector("select");
    if (select) select.value = this.slice.chosen.join();
    picked.hidden = pairs.length < 2;
    return picked;
  }

  private starts(symbols: string[]): HTMLElement {
    const fields = this.fields.map((field, i) => make("label", {}, make("span", {}, symbols[i]), field));
    const start = button("Start here", "Start from these numbers", () => this.onStart(this.fields.map((field) => field.valueAsNumber || 0)));
    const details = make("details", {}, make("summary", {}, "Start from a state"), make("div", { class: "starts" }, ...fields, start));
    details.addEventListener("toggle", () => this.fill());
    return details;
  }

  private fill(): void {
    this.fields.forEach((field, i) => { field.value = this.numbers[i].dataset.value ?? "0"; });
  }

  /** Show the table around upright rest, where nothing plays. */
  showAlone(poles: number): void {
    requestAnimationFrame((now) => this.showState(new Array(2 + 2 * poles).fill(0), now));
  }

  /** Show the state that a game is in. */
  show(play: Play, now: number): void {
    this.showState(this.policy.seen(play.state), now);
  }

  private showState(state: number[], now: number): void {
    this.slice.draw(state, now);
    if (now - this.shownAt < 50) return;
    this.shownAt = now;
    const { values, action } = this.policy.look(state);
    this.range = [Math.min(this.range[0], ...values), Math.max(this.range[1], ...values)];
    const [low, high] = this.range;
    this.bars.forEach(({ value, bar, row }, i) => {
      value.textContent = brief(values[i]);
      bar.style.width = `${8 + (92 * (values[i] - low)) / (high - low || 1)}%`;
      row.classList.toggle("chosen", action === i);
    });
    state.forEach((value, i) => {
      this.numbers[i].textContent = brief(value);
      this.numbers[i].dataset.value = String(Number(value.toPrecision(6)));
    });
  }
}
