/** Numbers as people read them: three or more digits, exponents as powers of ten, a unit. */

const SUPERSCRIPTS = "⁰¹²³⁴⁵⁶⁷⁸⁹";

/** A whole exponent as superscript, `10⁻⁸`. */
export function powerOfTen(exponent: number): string {
  const digits = [...String(Math.abs(exponent))].map((digit) => SUPERSCRIPTS[Number(digit)]).join("");
  return `10${exponent < 0 ? "⁻" : ""}${digits}`;
}

/** A number with `digits` significant ones. */
export function figure(value: number, digits = 4): string {
  if (!Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e-3 && size < 1e6) return trimmed(value.toPrecision(digits));
  const [mantissa, exponent] = value.toExponential(Math.min(digits - 1, 2)).split("e");
  return `${trimmed(mantissa)}·${powerOfTen(Number(exponent))}`.replace("-", "−");
}

function trimmed(text: string): string {
  const plain = text.includes("e") ? String(Number(text)) : text;
  return (plain.includes(".") ? plain.replace(/\.?0+$/, "") : plain).replace("-", "−");
}

/** A number with its unit; units of 1 are not written. */
export function quantity(value: number, unit: string, digits = 4): string {
  return unit === "1" || unit === "" ? figure(value, digits) : `${figure(value, digits)} ${unit}`;
}

/** The numbers of a vector, with a unit. */
export function vector(values: ArrayLike<number>, unit: string, digits = 4): string {
  const parts = Array.from(values, (value) => figure(value, digits));
  return `(${parts.join(", ")})${unit === "1" ? "" : ` ${unit}`}`;
}

/** A size of a file. */
export function bytes(count: number): string {
  return count < 1e6 ? `${(count / 1e3).toFixed(0)} kB` : `${(count / 1e6).toFixed(1)} MB`;
}

/** A count with its noun, of one or of several. */
export function counted(count: number, noun: string, several = `${noun}s`): string {
  return `${count.toLocaleString("en")} ${count === 1 ? noun : several}`;
}
