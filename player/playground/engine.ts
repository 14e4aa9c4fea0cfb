/**
 * The engine of the page: WebAssembly behind plain functions (`crates/playground/src/door.rs`). Requests and answers are
 * JSON, frames are numbers. An engine that stops for good is started again, so that the page never loses it.
 */

/** What the module exports. */
interface Door {
  memory: WebAssembly.Memory;
  carom_request(length: number): number;
  carom_answer(): number;
  carom_steps(count: number): number;
  carom_answer_at(): number;
  carom_answer_length(): number;
  carom_frame_at(): number;
  carom_frame_length(): number;
}

/** The engine stopped for good and was started again: what ran is gone. */
export class Restarted extends Error {}

/** See the file's head. */
export class Engine {
  private constructor(
    private readonly module: WebAssembly.Module,
    private door: Door,
  ) {}

  /** The engine that was packed into the page. */
  static async start(): Promise<Engine> {
    const script = document.querySelector('script[type="application/carom-engine"]');
    const text = script?.textContent?.trim();
    if (!text) throw new Error("This page was built without the engine; build it with make playground.");
    script?.remove();
    const plain = atob(text);
    const packed = Uint8Array.from(plain, (sign) => sign.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    const module = await WebAssembly.compile(await new Response(stream).arrayBuffer());
    return new Engine(module, await opened(module));
  }

  /** Answers a request. Raises an error with the engine's own sentence. */
  ask(request: Record<string, unknown>): unknown {
    const bytes = new TextEncoder().encode(JSON.stringify(request));
    return this.guarded(() => {
      const at = this.door.carom_request(bytes.length);
      new Uint8Array(this.door.memory.buffer, at, bytes.length).set(bytes);
      const refused = this.door.carom_answer() !== 0;
      const told = this.told();
      if (refused) throw new Error(told);
      return JSON.parse(told) as unknown;
    });
  }

  /** Takes steps; the sentence of a refused one, or nothing. The frame is that of the state after them. */
  steps(count: number): string {
    return this.guarded(() => (this.door.carom_steps(count) === 0 ? "" : this.told()));
  }

  /** A copy of the last frame's numbers. */
  frame(): Float64Array {
    const { door } = this;
    return new Float64Array(door.memory.buffer, door.carom_frame_at(), door.carom_frame_length()).slice();
  }

  private told(): string {
    const { door } = this;
    return new TextDecoder().decode(
      new Uint8Array(door.memory.buffer, door.carom_answer_at(), door.carom_answer_length()),
    );
  }

  private guarded<T>(act: () => T): T {
    try {
      return act();
    } catch (error) {
      if (!(error instanceof WebAssembly.RuntimeError) && !(error instanceof RangeError)) throw error;
      this.door = new WebAssembly.Instance(this.module, {}).exports as unknown as Door;
      throw new Restarted(`The engine stopped (${error.message}) and was started again.`);
    }
  }
}

async function opened(module: WebAssembly.Module): Promise<Door> {
  return (await WebAssembly.instantiate(module, {})).exports as unknown as Door;
}
