import type { ScopeData } from "./interface";

// What the scope has taken of the daemon's signals, where it triggers, and what frequencies are in them.

export type Column = (number | null)[];

/** The newest periods of some signals. */
export class ScopeRows {
  periods: number[] = [];
  columns: Column[];
  /** Periods that were never told, because the page was too slow. */
  lost = 0;

  constructor(readonly signals: string[], private readonly rowsMax: number) {
    this.columns = signals.map(() => []);
  }

  /** The period from which on something is missing; -n: the last n. */
  next(): number {
    return this.periods.length ? this.periods[this.periods.length - 1] + 1 : -Math.min(this.rowsMax, 1000);
  }

  take(data: ScopeData) {
    const last = this.periods[this.periods.length - 1];
    // A daemon that began anew counts from 0.
    if (last !== undefined && data.newest < last) this.clear();
    else if (last !== undefined && data.periods.length) this.lost += Math.max(0, data.periods[0] - last - 1);
    for (const period of data.periods) this.periods.push(period);
    data.values.forEach((values, k) => values.forEach((value) => this.columns[k].push(value)));
    const over = this.periods.length - this.rowsMax;
    if (over > 0) this.drop(over);
  }

  clear() {
    this.drop(this.periods.length);
    this.lost = 0;
  }

  private drop(count: number) {
    this.periods.splice(0, count);
    for (const column of this.columns) column.splice(0, count);
  }

  /** A copy of the rows from one index up to another. */
  part(from: number, to: number): ScopeRows {
    const out = new ScopeRows(this.signals, this.rowsMax);
    out.periods = this.periods.slice(from, to);
    out.columns = this.columns.map((column) => column.slice(from, to));
    out.lost = this.lost;
    return out;
  }
}

export type Edge = "rising" | "falling";

/** The index of the first row behind `from` in which the column crosses the level; -1: none. */
export function crossing(column: Column, edge: Edge, level: number, from: number): number {
  for (let i = Math.max(1, from); i < column.length; ++i) {
    const [before, now] = [column[i - 1], column[i]];
    if (before === null || now === null) continue;
    if (edge === "rising" ? before < level && now >= level : before > level && now <= level) return i;
  }
  return -1;
}

/** Amplitudes of a signal over its frequencies in Hz: of all rows, Hann window, mean taken off, zeros up to a power of two. */
export function spectrum(column: Column, periodS: number): { frequency: number[]; amplitude: number[] } {
  const m = column.length, n = 2 ** Math.ceil(Math.log2(Math.max(1, m)));
  const known = column.filter((value) => value !== null) as number[];
  if (known.length < 16) return { frequency: [], amplitude: [] };
  const mean = known.reduce((sum, value) => sum + value, 0) / known.length;
  const re = new Float64Array(n), im = new Float64Array(n);  // zeros behind what is shown
  for (let i = 0; i < m; ++i) re[i] = ((column[i] ?? mean) - mean) * (0.5 - 0.5 * Math.cos((2 * Math.PI * i) / m));
  transform(re, im);
  const frequency: number[] = [], amplitude: number[] = [];
  for (let k = 1; k < n / 2; ++k) {
    frequency.push(k / (n * periodS));
    amplitude.push((4 / m) * Math.hypot(re[k], im[k]));  // 2/n for one side, 2 for the window's mean
  }
  return { frequency, amplitude };
}

/** The discrete Fourier transform in place; the length is a power of two (Cooley and Tukey). */
function transform(re: Float64Array, im: Float64Array) {
  const n = re.length;
  for (let i = 1, j = 0; i < n; ++i) {
    let bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) [re[i], re[j], im[i], im[j]] = [re[j], re[i], im[j], im[i]];
  }
  for (let size = 2; size <= n; size *= 2) {
    for (let k = 0; k < size / 2; ++k) {
      const [c, s] = [Math.cos((-2 * Math.PI * k) / size), Math.sin((-2 * Math.PI * k) / size)];
      for (let a = k; a < n; a += size) {
        const b = a + size / 2;
        const [x, y] = [re[b] * c - im[b] * s, re[b] * s + im[b] * c];
        [re[b], im[b]] = [re[a] - x, im[a] - y];
        [re[a], im[a]] = [re[a] + x, im[a] + y];
      }
    }
  }
}

/** As 'trunnion scope --csv' has it: a row a period. */
export function csvOf(rows: ScopeRows, periodS: number): string {
  const lines = [["period", "time_s", ...rows.signals].join(",")];
  rows.periods.forEach((period, i) => {
    const time = (period * periodS).toFixed(6);
    lines.push([period, time, ...rows.columns.map((column) => column[i] ?? "")].join(","));
  });
  return lines.join("\n") + "\n";
}
