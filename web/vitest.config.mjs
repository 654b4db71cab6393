import { rewritten } from "./mujoco-script.mjs";

const mujocoScript = {
  name: "mujoco-script",
  transform: (code, id) => (/@mujoco[\\/]mujoco[\\/]mujoco\.js$/.test(id) ? rewritten(code) : undefined),
};

export default { plugins: [mujocoScript], test: { include: ["src/**/*.test.ts"], server: { deps: { inline: ["@mujoco/mujoco"] } } } };
