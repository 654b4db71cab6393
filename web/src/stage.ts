/** The stage: the scene on its canvas, what one can do with it, and the loop that moves it. */
import { Vector2, WebGLRenderer } from "three";
import { button, choice, make, wantsStillness } from "./dom";
import type { Mujoco } from "./engine";
import { Gap } from "./gap";
import type { Play, Ending } from "./play";
import { Pull } from "./pull";
import { Scene } from "./scene";

const SPEEDS: [string, string][] = [["1", "real time"], ["0.5", "half speed"], ["0.2", "a fifth"], ["0.05", "a twentieth"]];
const DELAYS: [string, string][] = [["0", "none"], ...[1, 2, 3, 4, 5, 6].map((n): [string, string] => [`${n}`, n === 1 ? "1 step" : `${n} steps`])];
const NOISES: [string, string][] = [["0", "none"], ["0.01", "0.01"], ["0.03", "0.03"], ["0.1", "0.1"], ["0.2", "0.2"]];
const AFTER_THE_END = 1.4;
const WORDS: Record<Ending, string> = {
  cart: "the cart left the track",
  pole: "the pole fell",
  time: "the time limit",
  diverged: "the physics diverged",
};

/** Shows a game, and lets a visitor take part in it. */
export class Stage {
  readonly element: HTMLElement;
  play!: Play;
  paused = wantsStillness();
  speed = 1;
  /** Called after each picture. */
  onFrame: (play: Play, now: number) => void = () => undefined;
  /** Called when somebody else is to push. */
  onPlayer: () => void = () => undefined;
  private scene!: Scene;
  private readonly canvas = make("canvas", {
    tabindex: "0",
    role: "img",
    "aria-label": "The cart-pole. Drag the pole or the cart; left and right arrow keys push; space pauses; S steps; R starts again.",
  });
  private readonly renderer: WebGLRenderer;
  private readonly said = make("p", { class: "said", role: "status", "aria-live": "polite" });
  private readonly score = make("div", { class: "score", hidden: true });
  private readonly gap = new Gap();
  private readonly cameras = make("select", { "aria-label": "Camera", change: () => this.chooseCamera() });
  private readonly playButton: HTMLButtonElement;
  private readonly youButton: HTMLButtonElement;
  private last = 0;
  private sinceEnd = 0;

  constructor(private readonly mujoco: Mujoco) {
    this.renderer = new WebGLRenderer({ canvas: this.canvas, antialias: true });
    this.playButton = button("Pause", "Play or pause (space)", () => this.toggle());
    this.youButton = button("You against the table", "Balance by hand, beside the table (Y)", () => this.challenge());
    this.youButton.classList.add("accent");
    const speed = choice("Speed", SPEEDS, (value) => { this.speed = Number(value); });
    const bar = make("div", { class: "bar" },
      this.playButton, button("Step", "One control step (S)", () => this.stepOnce()),
      button("Restart", "Start again from a new state (R)", () => this.restart()), this.youButton, this.hands());
    const more = make("div", { class: "bar" },
      make("p", { class: "hint" }, "Drag the pole or the cart; arrow keys push."),
      speed, choice("Delay of the table's pushes", DELAYS, (value) => { this.gap.delay = Number(value); }),
      choice("Noise of what it sees", NOISES, (value) => { this.gap.noise = Number(value); }),
      make("label", { class: "choice" }, make("span", {}, "Camera"), this.cameras));
    const view = make("div", { class: "view" }, this.canvas, this.score, this.said);
    this.element = make("div", { class: "stage" }, view, bar, more);
    this.listen();
    new ResizeObserver(() => this.resize()).observe(view);
    requestAnimationFrame((time) => this.frame(time));
  }

  /** Buttons that push, for those without a keyboard. */
  private hands(): HTMLElement {
    const hand = (text: string, label: string, way: number) => {
      const down = () => { this.play.keys = way; };
      const up = () => { this.play.keys = 0; };
      return make("button", { type: "button", class: "hand", "aria-label": label, pointerdown: down, pointerup: up, pointerleave: up, pointercancel: up }, text);
    };
    return make("div", { class: "hands" }, hand("◀", "Push to the left", -1), hand("▶", "Push to the right", 1));
  }

  /** Show another game. */
  show(play: Play): void {
    const before = this.play as Play | undefined;
    this.play = play;
    play.gap = this.gap;
    if (before) play.best = before.best;
    this.dress();
    before?.delete();
    this.sinceEnd = 0;
  }

  /** Draw the game's model anew, by day or by night. */
  private dress(): void {
    this.scene?.delete();
    this.scene = new Scene(this.renderer, this.mujoco, this.play.cartpole, this.play.task);
    const names = this.scene.cameras;
    const chosen = names.includes(this.cameras.value) ? this.cameras.value : names[0];
    this.cameras.replaceChildren(...names.map((name) => make("option", { value: name, selected: name === chosen }, name)));
    this.chooseCamera();
  }

  private chooseCamera(): void {
    this.scene.seenBy = this.cameras.value;
  }

  toggle(): void {
    this.paused = !this.paused;
  }

  stepOnce(): void {
    this.paused = true;
    this.play.step();
  }

  restart(state?: number[]): void {
    this.play.restart(state);
    this.sinceEnd = 0;
  }

  /** Begin a contest, or end it. */
  challenge(): void {
    this.play.player = this.play.player === "you" ? "table" : "you";
    this.youButton.textContent = this.play.player === "you" ? "Let the table play" : "You against the table";
    this.restart();
    this.paused = false;
    this.canvas.focus();
    this.onPlayer();
  }

  private frame(time: number): void {
    const seconds = Math.min((time - this.last) / 1000, 0.25);
    this.last = time;
    requestAnimationFrame((next) => this.frame(next));
    if (!this.play) return;
    if (!this.paused) this.move(seconds);
    this.draw();
    this.onFrame(this.play, time);
  }

  private move(seconds: number): void {
    const { play } = this;
    play.advance(seconds * this.speed);
    this.sinceEnd = play.isOver ? this.sinceEnd + seconds : 0;
    if (play.player === "table" && this.sinceEnd > AFTER_THE_END) this.restart();
    if (play.player === "you" && this.sinceEnd > 2 * AFTER_THE_END) this.restart();
  }

  draw(): void {
    const { play } = this;
    this.scene.draw(play.state, play.rival?.state ?? null, play.ending === null ? play.nextPush : 0, play.pull?.ends ?? null);
    this.playButton.textContent = this.paused ? "Play" : "Pause";
    const text = this.words();
    if (this.said.textContent !== text) this.said.textContent = text;
    this.score.hidden = play.player !== "you";
    if (!this.score.hidden) this.score.replaceChildren(...this.scores());
  }

  private words(): string {
    const { play } = this;
    if (play.isWaiting) return "Hold ◀ or ▶ to push: it begins with your first push";
    if (play.ending === null) return "";
    const seconds = (play.steps * play.simulation.controlStep).toFixed(1);
    return `${WORDS[play.ending]} after ${play.steps} steps, ${seconds} s`;
  }

  private scores(): HTMLElement[] {
    const { play } = this;
    const line = (who: string, steps: number, how: string) =>
      make("div", {}, make("span", {}, who), make("strong", {}, String(steps)), make("small", {}, how));
    const of = (ending: Ending | null) => (ending ? WORDS[ending] : "");
    return [line("You", play.steps, of(play.ending)), line("The table", play.rivalSteps, of(play.rivalEnding)), line("Your best", play.best, "")];
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
  }

  private listen(): void {
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => this.grab(event));
    // What is grabbed does not scroll the page; what is not does.
    canvas.addEventListener("touchstart", (event) => { if (this.play.pull) event.preventDefault(); }, { passive: false });
    canvas.addEventListener("pointermove", (event) => this.drag(event));
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, () => this.release());
    addEventListener("keydown", (event) => this.key(event, true));
    addEventListener("keyup", (event) => this.key(event, false));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.dress());
    addEventListener("blur", () => { if (this.play) this.play.keys = 0; });
  }

  private placeOf(event: PointerEvent): Vector2 {
    const box = this.canvas.getBoundingClientRect();
    return new Vector2(((event.clientX - box.left) / box.width) * 2 - 1, 1 - ((event.clientY - box.top) / box.height) * 2);
  }

  private grab(event: PointerEvent): void {
    const grip = this.scene.grip(this.placeOf(event));
    if (!grip) return;
    event.preventDefault();
    this.canvas.setPointerCapture(event.pointerId);
    this.release();
    this.play.pull = new Pull(this.mujoco, this.play.simulation, grip);
    this.canvas.classList.add("dragging");
  }

  private drag(event: PointerEvent): void {
    const { pull } = this.play;
    if (!pull) {
      this.canvas.classList.toggle("over", event.pointerType === "mouse" && this.scene.grip(this.placeOf(event)) !== null);
      return;
    }
    pull.towards = this.scene.pointAt(this.placeOf(event), pull.grip.point);
  }

  private release(): void {
    this.play.pull?.delete();
    this.play.pull = null;
    this.canvas.classList.remove("dragging");
  }

  private key(event: KeyboardEvent, isDown: boolean): void {
    const target = event.target as HTMLElement;
    if (!this.play || event.ctrlKey || event.metaKey || event.altKey) return;
    if (/^(INPUT|TEXTAREA|SELECT)$/.test(target.tagName) || target.dataset.keys === "own") return;
    const way = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (way !== undefined) {
      if (isDown) this.play.keys = way;
      else if (this.play.keys === way) this.play.keys = 0;
      event.preventDefault();
      return;
    }
    const acts: Record<string, () => void> = { " ": () => this.toggle(), s: () => this.stepOnce(), r: () => this.restart(), y: () => this.challenge() };
    const act = acts[event.key.toLowerCase()];
    if (!isDown || !act || (event.key === " " && target.tagName === "BUTTON")) return;
    event.preventDefault();
    act();
  }

  /** Where in the window a body is seen, for tests. */
  windowPlaceOf(body: number): [number, number] {
    const box = this.canvas.getBoundingClientRect();
    const seen = this.scene.seenAt(this.scene.middleOf(body));
    return [box.left + ((seen.x + 1) / 2) * box.width, box.top + ((1 - seen.y) / 2) * box.height];
  }
}
