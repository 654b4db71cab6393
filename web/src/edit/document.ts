/**
 * An MJCF as text that is edited in place: what is not edited stays as it was written. See
 * physics/edit/document.py.
 */
import { Unfit } from "../cartpole";

const TAG =
  /<!--[\s\S]*?-->|<\?[\s\S]*?\?>|<\/\s*[^\s>]+\s*>|<\s*([^\s/>!?]+)((?:\s+[^\s=/>"']+\s*=\s*(?:"[^"]*"|'[^']*'))*)\s*(\/?)>/g;
const ATTRIBUTE = /\s+([^\s=/>"']+)\s*=\s*("[^"]*"|'[^']*')/y;
const ENTITIES: Record<string, string> = { lt: "<", gt: ">", amp: "&", quot: '"', apos: "'" };

/** An element of a document. */
export class Element {
  readonly attributes = new Map<string, string>();
  readonly children: Element[] = [];

  constructor(
    readonly tag: string,
    readonly parent: Element | null,
    /** Where its tag's name begins. */
    public start: number,
  ) {}

  /** Return the numbers of an attribute; three zeros where it is missing. */
  numbers(name: string): number[] {
    return (this.attributes.get(name) ?? "0 0 0").trim().split(/\s+/).map(Number);
  }

  /** Return the element and all in it, in the order of the document. */
  walk(): Element[] {
    return [this, ...this.children.flatMap((child) => child.walk())];
  }

  /** Return its children of a tag; those inside a <frame> count as its own. */
  find(tag: string): Element[] {
    return this.children.flatMap((child) => [
      ...(child.tag === tag ? [child] : []),
      ...(child.tag === "frame" ? child.find(tag) : []),
    ]);
  }
}

/** An MJCF text and its elements. */
export class Document {
  root!: Element;
  private elements: Element[] = [];

  constructor(public text: string) {
    this.parse();
  }

  /** Give an element an attribute; a value that is there already keeps its spelling. */
  set(element: Element, name: string, value: string): void {
    if (element.attributes.get(name) === value) return;
    let end = element.start + element.tag.length;
    for (const match of this.attributesOf(element)) {
      end = match.index + match[0].length;
      if (match[1] === name) {
        this.replace(end - match[2].length, end, `${match[2][0]}${quoted(value)}${match[2][0]}`);
        element.attributes.set(name, value);
        return;
      }
    }
    this.replace(end, end, ` ${name}="${quoted(value)}"`);
    element.attributes.set(name, value);
  }

  /** Return the last of the root's sections of a tag; one that is missing is put in. */
  section(tag: string): Element {
    const found = this.root.children.filter((child) => child.tag === tag).at(-1);
    if (found) return found;
    const end = this.text.indexOf(">", this.endOfAttributes(this.root)) + 1;
    this.replace(end, end, `\n  <${tag}/>`);
    this.parse();
    return this.section(tag);
  }

  private parse(): void {
    this.elements = [];
    const open: Element[] = [];
    for (const match of this.text.matchAll(TAG)) {
      const [whole, tag, attributes, closed] = match;
      if (whole.startsWith("</")) open.pop();
      if (tag === undefined) continue;
      const parent = open.at(-1) ?? null;
      const element = new Element(tag, parent, match.index + whole.indexOf(tag));
      for (const found of attributes.matchAll(new RegExp(ATTRIBUTE, "g")))
        element.attributes.set(found[1], plain(found[2].slice(1, -1)));
      if (parent) parent.children.push(element);
      else this.root = element;
      this.elements.push(element);
      if (!closed) open.push(element);
    }
    if (this.elements.length === 0) throw new Unfit("The document has no elements.");
  }

  private *attributesOf(element: Element): Generator<RegExpExecArray> {
    const attribute = new RegExp(ATTRIBUTE);
    attribute.lastIndex = element.start + element.tag.length;
    for (let match = attribute.exec(this.text); match; match = attribute.exec(this.text)) yield match;
  }

  private endOfAttributes(element: Element): number {
    const last = [...this.attributesOf(element)].at(-1);
    return last ? last.index + last[0].length : element.start + element.tag.length;
  }

  private replace(start: number, end: number, text: string): void {
    this.text = this.text.slice(0, start) + text + this.text.slice(end);
    for (const element of this.elements) if (element.start >= end) element.start += text.length - (end - start);
  }
}

const quoted = (value: string): string =>
  value.replace(/[&<>"']/g, (sign) => `&${Object.keys(ENTITIES).find((name) => ENTITIES[name] === sign)};`);

const plain = (value: string): string => value.replace(/&(\w+);/g, (whole, name: string) => ENTITIES[name] ?? whole);

/** Return a number as MJCF writes it; as written, if it is that. */
export function numberText(value: number, written = ""): string {
  return written !== "" && Number(written) === value ? written : String(value);
}
