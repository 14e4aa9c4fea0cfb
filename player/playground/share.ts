/** The state of the page as the end of its address: JSON, deflated, base64url. Nothing is sent anywhere. */

import type { Triangles } from "./meshes";

/** What a link holds: the scene as it was chosen or written, with its meshes, or the whole state of a run. */
export interface Shared {
  name?: string;
  text?: string;
  meshes?: Record<string, Triangles>;
  snapshot?: string;
  settings?: Record<string, unknown>;
  friction?: number;
  restitution?: number;
  /** With a snapshot: friction and restitution that the bodies have in the scene, where all were given others [1]. */
  own?: [number, number][];
}

const KEY = "#s=";

/** The end of an address that holds a state. */
export async function packed(state: Shared): Promise<string> {
  const stream = new Blob([JSON.stringify(state)]).stream().pipeThrough(new CompressionStream("deflate-raw"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  let text = "";
  for (const byte of bytes) text += String.fromCharCode(byte);
  return KEY + btoa(text).replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "");
}

/** The state in the end of an address; undefined when there is none. */
export async function unpacked(hash: string): Promise<Shared | undefined> {
  if (!hash.startsWith(KEY)) return undefined;
  try {
    const plain = atob(hash.slice(KEY.length).replaceAll("-", "+").replaceAll("_", "/"));
    const bytes = Uint8Array.from(plain, (sign) => sign.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
    return JSON.parse(await new Response(stream).text()) as Shared;
  } catch {
    throw new Error("This link is damaged: it holds no state that can be read.");
  }
}
