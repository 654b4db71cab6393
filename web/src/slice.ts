/** A slice through the table: for two values of the state, which action is better and by how much. */
import { isDark, make } from "./dom";
import { brief, type Quantity } from "./names";
import type { Policy } from "./policy";

const SAMPLES = 60;
const EVERY = 120;
const MARGIN = { left: 46, bottom: 34, top: 8, right: 8 };
const LEFT = [[0, 114, 178], [86, 180, 233]];
const RIGHT = [[213, 94, 0], [255, 138, 61]];
const EVEN = [[250, 250, 251], [30, 36, 44]];

interface Span {
  dimension: number;
  bins: number;
  low: number;
  high: number;
  samples: number;
}

/** Draws the slice around a state, and starts where one clicks. */
export class Slice {
  readonly canvas = make("canvas", { class: "slice", role: "img", tabindex: "0", "data-keys": "own" });
  onStart: (state: number[]) => void = () => undefined;
  private readonly picture = document.createElement("canvas");
  private spans: [Span, Span] | null = null;
  private state: number[] = [];
  private key = "";
  private drawnAt = -EVERY;
  private cursor: [number, number] | null = null;

  constructor(
    private readonly policy: Policy,
    private readonly names: Quantity[],
  ) {
    this.canvas.addEventListener("click", (event) => this.click(event));
    this.canvas.addEventListener("keydown", (event) => this.press(event));
    this.canvas.addEventListener("blur", () => { this.cursor = null; });
    const used = policy.axes.map(({ dimension }) => dimension);
    const usual = used.includes(2) && used.includes(3) ? [2, 3] : used.slice(0, 2);
    this.choose(usual[0] ?? 2, usual[1] ?? 3);
  }

  /** Show other two values of the state. */
  choose(across: number, up: number): void {
    this.spans = [this.spanOf(across), this.spanOf(up)];
    this.key = "";
    const [a, b] = [this.names[across], this.names[up]];
    this.canvas.setAttribute("aria-label",
      `A slice of the table over the ${a.name} and the ${b.name}: blue where pushing to the left is better, orange where to the right. Click a place to start there; with the keyboard, arrows move and Enter starts.`);
  }

  get chosen(): [number, number] {
    return this.spans ? [this.spans[0].dimension, this.spans[1].dimension] : [2, 3];
  }

  private spanOf(dimension: number): Span {
    const { bins, low, high } = this.policy.grid;
    const count = Math.max(bins[dimension], 1);
    return { dimension, bins: count, low: low[dimension], high: high[dimension], samples: count * Math.ceil(SAMPLES / count) };
  }

  /** Draw it around a state. */
  draw(state: number[], now: number): void {
    this.state = state;
    const box = this.canvas.getBoundingClientRect();
    if (!this.spans || box.width === 0) return;
    const ratio = Math.min(devicePixelRatio, 2);
    const [width, height] = [Math.round(box.width * ratio), Math.round(box.height * ratio)];
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    const context = this.canvas.getContext("2d");
    if (!context) return;
    if (now - this.drawnAt > EVERY && this.isStale()) {
      this.paint(this.spans);
      this.drawnAt = now;
    }
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, box.width, box.height);
    this.frame(context, box.width, box.height);
  }

  /** Return whether the other values of the state are in other cells than when it was painted. */
  private isStale(): boolean {
    const { axes } = this.policy;
    const cells = this.policy.cells(this.state).filter((_, i) => !this.chosen.includes(axes[i].dimension));
    const key = `${cells.join()} ${isDark()}`;
    const stale = key !== this.key;
    this.key = key;
    return stale;
  }

  private paint([across, up]: [Span, Span]): void {
    const state = [...this.state];
    const gains: number[] = [];
    for (let j = 0; j < up.samples; j++)
      for (let i = 0; i < across.samples; i++) {
        state[across.dimension] = across.low + ((i + 0.5) / across.samples) * (across.high - across.low);
        state[up.dimension] = up.high - ((j + 0.5) / up.samples) * (up.high - up.low);
        const [left, right] = this.policy.look(state).values;
        gains.push(right - left);
      }
    const sizes = gains.map(Math.abs).sort((a, b) => a - b);
    const most = sizes[Math.floor(0.97 * (sizes.length - 1))] || sizes.at(-1) || 1;
    Object.assign(this.picture, { width: across.samples, height: up.samples });
    const image = new ImageData(across.samples, up.samples);
    gains.forEach((gain, i) => { image.data.set(colourOf(gain / most), 4 * i); });
    this.picture.getContext("2d")?.putImageData(image, 0, 0);
  }

  private area(width: number, height: number) {
    return { x: MARGIN.left, y: MARGIN.top, w: width - MARGIN.left - MARGIN.right, h: height - MARGIN.top - MARGIN.bottom };
  }

  private frame(context: CanvasRenderingContext2D, width: number, height: number): void {
    const { x, y, w, h } = this.area(width, height);
    const [across, up] = this.spans as [Span, Span];
    context.imageSmoothingEnabled = false;
    context.drawImage(this.picture, x, y, w, h);
    const style = getComputedStyle(this.canvas);
    const [ink, faint] = [style.color, style.getPropertyValue("--faint")];
    this.outline(context, ink, { x, y, w, h });
    const at = this.pixelOf(this.state, { x, y, w, h });
    dot(context, at, ink);
    if (this.cursor) cross(context, [x + this.cursor[0] * w, y + (1 - this.cursor[1]) * h], ink);
    context.fillStyle = faint;
    context.font = "12px system-ui, sans-serif";
    label(context, `${this.names[across.dimension].symbol}  (${this.names[across.dimension].unit})`, x + w / 2, height - 8, "center");
    label(context, brief(across.low, 2), x, height - 8, "left");
    label(context, brief(across.high, 2), x + w, height - 8, "right");
    label(context, brief(up.high, 2), x - 6, y + 10, "right");
    label(context, brief(up.low, 2), x - 6, y + h, "right");
    label(context, this.names[up.dimension].symbol, x - 10, y + h / 2 - 2, "right");
    label(context, this.names[up.dimension].unit, x - 6, y + h / 2 + 13, "right");
  }

  /** Outline the bin that the state is in, or the nodes around it. */
  private outline(context: CanvasRenderingContext2D, ink: string, area: Area): void {
    const [a, b] = (this.spans as [Span, Span]).map((span) => binOf(this.state[span.dimension], span, this.policy.grid.interpolated));
    context.strokeStyle = ink;
    context.lineWidth = 2;
    context.strokeRect(area.x + a[0] * area.w, area.y + (1 - b[1]) * area.h, (a[1] - a[0]) * area.w, (b[1] - b[0]) * area.h);
  }

  private pixelOf(state: number[], area: Area): [number, number] {
    const [a, b] = (this.spans as [Span, Span]).map(({ dimension, low, high }) =>
      Math.min(Math.max((state[dimension] - low) / (high - low), 0), 1));
    return [area.x + a * area.w, area.y + (1 - b) * area.h];
  }

  private click(event: MouseEvent): void {
    const box = this.canvas.getBoundingClientRect();
    const { x, y, w, h } = this.area(box.width, box.height);
    this.startAt((event.clientX - box.left - x) / w, 1 - (event.clientY - box.top - y) / h);
  }

  private press(event: KeyboardEvent): void {
    const moves: Record<string, [number, number]> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    const move = moves[event.key];
    const [a, b] = this.cursor ?? [0.5, 0.5];
    if (move) this.cursor = [clipped(a + 0.04 * move[0]), clipped(b + 0.04 * move[1])];
    else if (event.key === "Enter") this.startAt(a, b);
    else return;
    event.preventDefault();
  }

  /** Start in the middle of the bin at a place of the picture, or there where there are no bins. */
  private startAt(across: number, up: number): void {
    if (across < 0 || across > 1 || up < 0 || up > 1) return;
    const state = [...this.state];
    (this.spans as [Span, Span]).forEach((span, i) => {
      const share = [across, up][i];
      const bin = Math.min(Math.floor(share * span.bins), span.bins - 1);
      const place = this.policy.parts === 1 ? (bin + 0.5) / span.bins : share;
      state[span.dimension] = span.low + place * (span.high - span.low);
    });
    this.onStart(state);
  }
}

interface Area {
  x: number;
  y: number;
  w: number;
  h: number;
}

const clipped = (value: number): number => Math.min(Math.max(value, 0), 1);

function binOf(value: number, { low, high, bins }: Span, interpolated: boolean): [number, number] {
  const count = Math.max(interpolated ? bins - 1 : bins, 1);
  const bin = Math.min(Math.max(Math.floor(((value - low) / (high - low)) * count), 0), count - 1);
  return [bin / count, (bin + 1) / count];
}

function colourOf(gain: number): number[] {
  const night = Number(isDark());
  const [from, to] = [EVEN[night], gain < 0 ? LEFT[night] : RIGHT[night]];
  const share = Math.min(Math.abs(gain), 1) ** 0.6;
  return [...from.map((value, i) => value + share * (to[i] - value)), 255];
}

function dot(context: CanvasRenderingContext2D, [x, y]: [number, number], ink: string): void {
  context.beginPath();
  context.arc(x, y, 5.5, 0, 2 * Math.PI);
  context.fillStyle = isDark() ? "#12161b" : "#ffffff";
  context.strokeStyle = ink;
  context.lineWidth = 2.5;
  context.fill();
  context.stroke();
}

function cross(context: CanvasRenderingContext2D, [x, y]: [number, number], ink: string): void {
  context.strokeStyle = ink;
  context.lineWidth = 2;
  context.beginPath();
  context.moveTo(x - 8, y);
  context.lineTo(x + 8, y);
  context.moveTo(x, y - 8);
  context.lineTo(x, y + 8);
  context.stroke();
}

function label(context: CanvasRenderingContext2D, text: string, x: number, y: number, align: CanvasTextAlign): void {
  context.textAlign = align;
  context.fillText(text, x, y);
}
