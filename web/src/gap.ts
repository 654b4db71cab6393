/** The gap to reality, as far as the page adds one: a late motor and noisy sensors; see disturbances/effects.py. */

/** What is added to a game. */
export class Gap {
  /** Control steps from an action to its push. */
  delay = 0;
  /** Standard deviation of all that is seen. */
  noise = 0;
  private onTheirWay: number[] = [];

  /** Begin an episode: nothing is asked of the motor. */
  forget(): void {
    this.onTheirWay = [];
  }

  /** Return the control that arrives after one is sent; before the first it is that at rest. */
  arriving(sent: number, atRest: number): number {
    this.onTheirWay.push(sent);
    if (this.onTheirWay.length <= this.delay) return atRest;
    // A delay that was made shorter leaves out what is late.
    while (this.onTheirWay.length > this.delay + 1) this.onTheirWay.shift();
    return this.onTheirWay.shift() as number;
  }

  /** Return what is seen of a state. */
  seen(state: number[]): number[] {
    return this.noise === 0 ? state : state.map((value) => value + this.noise * normal());
  }
}

/** Draw a standard normal number (Box and Muller, 1958). */
function normal(): number {
  return Math.sqrt(-2 * Math.log(1 - Math.random())) * Math.cos(2 * Math.PI * Math.random());
}
