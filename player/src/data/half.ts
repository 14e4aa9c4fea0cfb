/** Numbers of 16 bits with 11 bits of mantissa (IEEE 754 binary16), which not every browser reads. */

let table: Float32Array | undefined;

/** The value of each of the 65536 codes. */
function values(): Float32Array {
  if (table) return table;
  table = new Float32Array(65536);
  for (let code = 0; code < 65536; code++) {
    const sign = code & 0x8000 ? -1 : 1;
    const exponent = (code >> 10) & 0x1f;
    const mantissa = code & 0x3ff;
    if (exponent === 0) table[code] = sign * mantissa * 2 ** -24;
    else if (exponent === 31) table[code] = mantissa ? Number.NaN : sign * Number.POSITIVE_INFINITY;
    else table[code] = sign * (1 + mantissa / 1024) * 2 ** (exponent - 15);
  }
  return table;
}

/** Halves as singles, times `scale`. */
export function fromHalves(codes: Uint16Array, scale: number): Float32Array {
  const of = values();
  const found = new Float32Array(codes.length);
  for (let i = 0; i < codes.length; i++) found[i] = of[codes[i]] * scale;
  return found;
}
