/** What the values of a state are called and measured in. */

export interface Quantity {
  symbol: string;
  name: string;
  unit: string;
}

/** Return what each value of a state is. */
export function quantities(poles: number): Quantity[] {
  const found: Quantity[] = [
    { symbol: "x", name: "place of the cart", unit: "m" },
    { symbol: "ẋ", name: "speed of the cart", unit: "m/s" },
  ];
  for (let pole = 1; pole <= poles; pole++) {
    const [sign, of] = poles > 1 ? ["₁₂₃₄₅₆₇₈₉"[pole - 1] ?? String(pole), ` of pole ${pole}`] : ["", " of the pole"];
    found.push({ symbol: `θ${sign}`, name: `angle${of}`, unit: "rad" }, { symbol: `θ̇${sign}`, name: `turning${of}`, unit: "rad/s" });
  }
  return found;
}

/** Return a number in few digits. */
export function brief(value: number, digits = 3): string {
  if (value === 0) return "0";
  if (Math.abs(value) >= 1e5 || Math.abs(value) < 1e-3) return value.toExponential(1).replace("-", "−");
  return value.toFixed(Math.max(0, digits - Math.max(0, Math.floor(Math.log10(Math.abs(value)))))).replace("-", "−");
}
