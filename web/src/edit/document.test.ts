import { expect, it } from "vitest";
import { Document, numberText } from "./document";
import { uniformRodInertia } from "./rescale";

const TEXT = `<!-- <body name="no"/> -->
<mujoco model='a &lt; b'>
  <worldbody>
    <body name="cart"> <!-- a > b -->
      <frame><geom size='1 2'/></frame>
      <joint  axis = "1 0 0"/>
    </body>
  </worldbody>
</mujoco>
`;

it("finds elements, those of frames too, and no comments", () => {
  const { root } = new Document(TEXT);
  expect(root.walk().map(({ tag }) => tag)).toEqual(["mujoco", "worldbody", "body", "frame", "geom", "joint"]);
  expect(root.attributes.get("model")).toBe("a < b");
  const body = root.children[0].children[0];
  expect(body.find("geom")).toHaveLength(1);
});

it("leaves all else as it was written", () => {
  const document = new Document(TEXT);
  const body = document.root.children[0].children[0];
  document.set(body.find("geom")[0], "size", "3 2");
  document.set(body.find("joint")[0], "damping", "0.5");
  document.set(body.find("joint")[0], "axis", `"<&>"`);
  expect(document.text).toBe(
    TEXT.replace("'1 2'", "'3 2'").replace(`"1 0 0"`, `"&quot;&lt;&amp;&gt;&quot;" damping="0.5"`),
  );
});

it("puts in a section that is missing", () => {
  const document = new Document(TEXT);
  document.set(document.section("option"), "gravity", "0 0 -1");
  expect(document.text).toContain(`<mujoco model='a &lt; b'>\n  <option gravity="0 0 -1"/>`);
});

it("keeps a number's spelling where it is that number", () => {
  expect([numberText(1, "1.0"), numberText(2, "1.0"), numberText(0.1)]).toEqual(["1.0", "2", "0.1"]);
});

it("rounds the inertia of a rod once", () => {
  expect([uniformRodInertia(0.1, 1), uniformRodInertia(0.1, 1.5), uniformRodInertia(3, 2)]).toEqual([1 / 120, 0.01875, 1]);
});
