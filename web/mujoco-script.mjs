// Two changes of MuJoCo's script. It makes functions from text, which a page's Content-Security-Policy
// forbids: here they call what they would have written out. And it does not know arrays of flags, such
// as jnt_limited: here they are bytes.
import { readFileSync } from "node:fs";

const REPLACED = [
  [
    "var invokerFn = new Function(...args, invokerFnBody)(...closureArgs);",
    `var invokerFn = function (...given) {
      checkArgCount(given.length, minArgs, expectedArgCount, humanName, throwBindingError);
      const destructors = needsDestructorStack ? [] : null;
      const wired = [cppTargetFunc];
      if (isClassMethodFunc) wired.push(argTypes[1].toWireType(destructors, this));
      const first = wired.length;
      for (let i = 0; i < expectedArgCount; ++i) wired.push(argTypes[i + 2].toWireType(destructors, given[i]));
      const rv = cppInvokerFunc(...wired);
      if (needsDestructorStack) runDestructors(destructors);
      else for (let i = first === 2 ? 1 : 2; i < argTypes.length; ++i)
        if (argTypes[i].destructorFunction !== null) argTypes[i].destructorFunction(wired[i - 2 + first]);
      return returns ? argTypes[0].fromWireType(rv) : undefined;
    };`,
  ],
  ["let [args, invokerFnBody] = createJsInvoker(argTypes, isClassMethodFunc, returns, isAsync);", ""],
  [
    "var invokerFunction = new Function(...params, functionBody)(...args);",
    `var invokerFunction = (obj, func, destructorsRef, at) => {
      const given = types.map((type) => {
        const value = type.readValueFromPointer(at);
        at += type.argPackAdvance;
        return value;
      });
      const rv = kind === 1 ? new func(...given) : kind === 0 ? func.call(obj, ...given) : func.call(...given);
      if (!retType.isVoid) return emval_returnValue(retType, destructorsRef, rv);
    };`,
  ],
  [
    // biome-ignore lint/suspicious/noTemplateCurlyInString: it is theirs, to be replaced
    "throwBindingError(`${humanName} has unknown type ${getTypeName(rawType)}`);",
    `const called = getTypeName(rawType);
    if (called !== "N10emscripten11memory_viewIbEE") throwBindingError(humanName + " has unknown type " + called);
    return { readValueFromPointer: (at) => new Uint8Array(HEAPU8.buffer, HEAPU32[(at + 4) >> 2], HEAPU32[at >> 2]) };`,
  ],
];

/** Return MuJoCo's script as a page can use it; other text than is known is an error. */
export function rewritten(script) {
  for (const [before, after] of REPLACED) {
    if (script.split(before).length !== 2) throw new Error(`@mujoco/mujoco has changed: ${before}`);
    script = script.replace(before, () => after);
  }
  if (script.includes("new Function(")) throw new Error("@mujoco/mujoco makes functions from text");
  return script;
}

export const mujocoScript = {
  name: "mujoco-script",
  setup(build) {
    build.onLoad({ filter: /@mujoco[\\/]mujoco[\\/]mujoco\.js$/ }, ({ path }) => ({
      contents: rewritten(readFileSync(path, "utf8")),
      loader: "js",
    }));
  },
};
