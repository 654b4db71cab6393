/** The run's recorded episode, played again: is it MuJoCo's, to the bit? */
import type { Policy } from "./policy";
import type { Simulation } from "./simulation";

export interface Parity {
  steps: number;
  equal: number;
  /** The first step whose state differs; null if none does. */
  firstApart: number | null;
  /** The largest difference over the first hundred steps, and over all. */
  early: number;
  worst: number;
}

/** Play a recorded episode in closed loop, and compare every state. */
export function replay(simulation: Simulation, policy: Policy, states: Float64Array): Parity {
  const size = simulation.state.length;
  const steps = states.length / size - 1;
  const found: Parity = { steps, equal: 0, firstApart: null, early: 0, worst: 0 };
  simulation.state = states.subarray(0, size);
  for (let step = 1; step <= steps; step++) {
    simulation.step(simulation.cartpole.controls[policy.look(simulation.state).action]);
    const apart = largestGap(simulation.state, states.subarray(step * size, (step + 1) * size));
    if (apart === 0) found.equal += 1;
    else found.firstApart ??= step;
    found.worst = Math.max(found.worst, apart);
    if (step <= 100) found.early = Math.max(found.early, apart);
  }
  return found;
}

/** Return the largest difference of two states; the smallest one where only the sign of a zero differs. */
function largestGap(state: number[], wanted: Float64Array): number {
  return Math.max(...state.map((value, i) => (Object.is(value, wanted[i]) ? 0 : Math.abs(value - wanted[i]) || Number.MIN_VALUE)));
}

/** Say what a replay has shown. */
export function parityText(found: Parity, native: string, here: string): string {
  const { steps, equal, firstApart, worst } = found;
  if (firstApart === null) return `${equal} of ${steps} steps bit-equal to MuJoCo ${native}`;
  return `${equal} of ${steps} steps bit-equal to MuJoCo ${native}; they part at step ${firstApart}, by ${worst.toExponential(1)} at most (MuJoCo ${here} here)`;
}
