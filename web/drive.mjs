// Opens a page in a real browser, from disk and without a network, and does what stdin says in JSON:
// {file, browser, width, height, dark, still, without: ["WebGL2RenderingContext", …], acts: [{evaluate: "…"}, {do: "…"},
//  {press: "Space"}, {hold: "ArrowLeft", ms: 200}, {drag: [[x, y], [x, y]]}, {click: "css"}, {at: [x, y]},
//  {fill: ["css", "text"]}, {wait: ms}, {until: "…"}, {shot: "file.png", whole: true}]}
// What each `evaluate` gives, what the console said and how long it took to begin come back as JSON.
import { chromium, firefox } from "playwright-core";

const FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
const HELD_MS = 400;

const acts = {
  evaluate: (page, { evaluate }) => page.evaluate(evaluate),
  do: (page, { do: script }) => page.evaluate(script),
  press: (page, { press }) => page.keyboard.press(press),
  hold: async (page, { hold, ms }) => {
    await page.keyboard.down(hold);
    await page.waitForTimeout(ms);
    await page.keyboard.up(hold);
  },
  drag: async (page, { drag: [from, to] }) => {
    await page.mouse.move(...from);
    await page.mouse.down();
    await page.mouse.move(...to, { steps: 8 });
    await page.waitForTimeout(HELD_MS);
  },
  release: (page) => page.mouse.up(),
  click: (page, { click }) => page.click(click),
  at: (page, { at }) => page.mouse.click(...at),
  fill: (page, { fill }) => page.fill(...fill),
  until: (page, { until }) => page.waitForFunction(until),
  wait: (page, { wait }) => page.waitForTimeout(wait),
  shot: (page, { shot, whole }) => page.screenshot({ path: shot, fullPage: whole === true }),
};

async function drive(wish) {
  const kind = wish.browser.includes("firefox") ? firefox : chromium;
  const browser = await kind.launch({ executablePath: wish.browser, args: kind === chromium ? FLAGS : [] });
  const context = await browser.newContext({
    viewport: { width: wish.width ?? 1280, height: wish.height ?? 900 },
    colorScheme: wish.dark ? "dark" : "light",
    reducedMotion: wish.still ? "reduce" : "no-preference",
    offline: true,
  });
  const page = await context.newPage();
  const said = [];
  page.on("console", (message) => said.push(`${message.type()}: ${message.text()}`));
  page.on("pageerror", (error) => said.push(`error: ${error.stack}`));
  page.on("dialog", (dialog) => {
    said.push(`dialog: ${dialog.message()}`);
    dialog.dismiss();
  });
  for (const name of wish.without ?? []) await page.addInitScript(`delete globalThis.${name}`);
  await page.addInitScript(wish.before ?? "");
  const start = Date.now();
  await page.goto(`file://${wish.file}`);
  await page.waitForFunction(() => window.mjcartpole?.isReady, null, { timeout: 60_000 });
  const ready = (Date.now() - start) / 1000;
  const found = [];
  for (const act of wish.acts ?? []) {
    const [name] = Object.keys(act).filter((key) => key in acts);
    const value = await acts[name](page, act);
    if (name === "evaluate") found.push(value);
  }
  await browser.close();
  return { ready, found, said };
}

let text = "";
for await (const part of process.stdin) text += part;
process.stdout.write(JSON.stringify(await drive(JSON.parse(text))));
