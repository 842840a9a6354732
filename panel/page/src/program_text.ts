/** The text of a program, by its lines; millions of them cost what the text costs. */
export class ProgramText {
  /** Where each line begins, and the end of the text. */
  private readonly starts: Uint32Array;

  /** `error`: why the machine refuses it, as FILE:LINE:COLUMN: what; "": it does not. */
  constructor(readonly path: string, private readonly text: string, readonly error = "") {
    let count = 0;
    for (let at = 0; at < text.length; ++count) {
      const end = text.indexOf("\n", at);
      at = end < 0 ? text.length : end + 1;
    }
    this.starts = new Uint32Array(count + 1);
    for (let at = 0, i = 0; i < count; ++i) {
      this.starts[i] = at;
      const end = text.indexOf("\n", at);
      at = end < 0 ? text.length : end + 1;
    }
    this.starts[count] = text.length;
  }

  /** The line that the error is about; 0: there is none. */
  get errorLine(): number {
    return Number(/:(\d+):/.exec(this.error)?.[1] ?? 0);
  }

  get lines(): number {
    return this.starts.length - 1;
  }

  /** Without its end; lines count from 1. */
  line(number: number): string {
    return number >= 1 && number <= this.lines ? this.text.slice(this.starts[number - 1], this.starts[number]).trimEnd() : "";
  }
}
