/** The panel of the model: sliders by meaning, and the document itself, compiled in the browser. */
import { type CartPole, loadCartPole, type Loader, Unfit } from "./cartpole";
import { button, make, section } from "./dom";
import { edited, type Edits, meaningsOf } from "./edit/meanings";
import { wordsOf } from "./engine";
import { brief } from "./names";

const UNITS: Record<string, string> = { length: "m", mass: "kg", gravity: "m/s²", force: "N", hinge: "N·m·s", rail: "N·s/m" };
const STEPS = 400;

interface Slider {
  key: string;
  input: HTMLInputElement;
  output: HTMLOutputElement;
  /** The value in the document as it is without edits. */
  own: number;
  most: number;
}

/** Edits the model of a run; every change is compiled by MuJoCo here. */
export class ModelPanel {
  readonly element: HTMLElement;
  /** Called with the cart-pole that is to be played on. */
  onModel: (cartpole: CartPole) => void = () => undefined;
  private readonly text = make("textarea", { spellcheck: "false", rows: "18", "aria-label": "The model's MJCF", wrap: "off" });
  private readonly error = make("pre", { class: "error", role: "alert", hidden: true });
  private readonly rows = make("div", { class: "sliders" });
  private sliders: Slider[] = [];
  private edits: Edits = {};
  private base: string;
  private isDue = false;

  constructor(
    private readonly loader: Loader,
    private readonly own: CartPole,
  ) {
    this.base = own.xml;
    const reset = button("Reset", "Back to the run's own model", () => this.reset());
    const compile = button("Compile", "Compile this document", () => this.compile());
    const editor = make("details", {}, make("summary", {}, "The document itself (MJCF)"), this.text, make("div", { class: "row" }, compile));
    this.element = section("model", "Change the model", make("p", { class: "note" },
      "Mass, centre and inertia follow a length, as with --set on the command line; the table stays as it was learned."),
      this.rows, this.error, editor, make("div", { class: "row" }, reset));
    this.lay(own);
  }

  /** Lay out sliders for a document as it is. */
  private lay(cartpole: CartPole): void {
    this.edits = {};
    this.text.value = cartpole.xml;
    this.sliders = Object.entries(meaningsOf(this.loader, cartpole)).map(([key, own]) => this.slider(key, own));
    this.rows.replaceChildren(...this.sliders.map(({ key, input, output }) =>
      make("label", { class: "slider" }, make("span", {}, key), input, output)));
  }

  private slider(key: string, own: number): Slider {
    const input = make("input", { type: "range", min: "0", max: String(STEPS), step: "1", "data-edit": key });
    const slider: Slider = { key, input, output: make("output"), own, most: mostOf(key, own) };
    input.value = String(placeOf(slider, own));
    input.addEventListener("input", () => this.set(key, valueAt(slider, Number(input.value))));
    this.say(slider, own);
    return slider;
  }

  private say({ key, input, output }: Slider, value: number): void {
    const unit = UNITS[key] ?? UNITS[key.replace(/^\w+\./, "")] ?? UNITS[key.replace(/\d*\..*$/, "")] ?? "";
    output.textContent = `${brief(value)} ${unit}`;
    input.setAttribute("aria-valuetext", output.textContent);
  }

  /** Edit by meaning; compiled as soon as the browser is free. */
  set(key: string, value: number): void {
    const slider = this.sliders.find((each) => each.key === key);
    if (!slider) throw new Unfit(`The model has no ${key} to edit.`);
    if (value === slider.own) delete this.edits[key];
    else this.edits[key] = value;
    slider.input.value = String(placeOf(slider, value));
    this.say(slider, value);
    if (this.isDue) return;
    this.isDue = true;
    setTimeout(() => {
      this.isDue = false;
      this.take(() => edited(this.loader, this.base, this.edits));
    });
  }

  /** Compile the document as it was written by hand. */
  compile(text: string = this.text.value): void {
    this.text.value = text;
    if (!this.take(() => text)) return;
    this.base = text;
    const cartpole = loadCartPole(this.loader, text);
    this.lay(cartpole);
    cartpole.model.delete();
  }

  reset(): void {
    this.compile(this.own.xml);
  }

  /** Take a document, or say why it cannot be; what runs goes on then. */
  private take(documentOf: () => string): boolean {
    try {
      const xml = documentOf();
      const cartpole = xml === this.own.xml ? this.own : loadCartPole(this.loader, xml);
      if (cartpole.hinges.length !== this.own.hinges.length) throw new Unfit("The table is for another number of poles.");
      this.text.value = xml;
      this.onModel(cartpole);
      this.error.hidden = true;
    } catch (error) {
      this.error.textContent = wordsOf(error);
      this.error.hidden = false;
    }
    return this.error.hidden;
  }
}

/** Return the largest value of a slider: of what can be 0 a few times a usual value, else four times its own. */
function mostOf(key: string, own: number): number {
  if (key.startsWith("hinge")) return Math.max(4 * own, 0.5);
  if (key.startsWith("rail")) return Math.max(4 * own, 5);
  return 4 * own;
}

const startsAtZero = (key: string): boolean => /^(hinge|rail)/.test(key);

function placeOf({ key, own, most }: Slider, value: number): number {
  if (startsAtZero(key)) return Math.round((STEPS * value) / most);
  return Math.round((STEPS * Math.log((16 * value) / (4 * own))) / Math.log(16));
}

/** Return a slider's value, of three digits; in its middle its own. */
function valueAt({ key, own, most }: Slider, place: number): number {
  if (startsAtZero(key)) return Number(((most * place) / STEPS).toPrecision(3));
  return place === STEPS / 2 ? own : Number(((own / 4) * 16 ** (place / STEPS)).toPrecision(3));
}
