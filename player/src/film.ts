/**
 * A film of a run, encoded in the browser: H.264 where there is an encoder for it, else VP9, in an MP4 file.
 * Frames are drawn one by one, so a slow machine makes the same film as a fast one.
 */

import { ArrayBufferTarget, Muxer } from "mp4-muxer";
import type { App } from "./app";

/** What a film is like. */
export interface FilmSettings {
  /** Pictures per second [1/s]. */
  fps: number;
  /** Simulated seconds per second of film [1]. */
  speed: number;
  /** Simulated times [s]. */
  from: number;
  to: number;
}

/** Bits of film per second and pixel [1/s]. */
const BITS_PER_PIXEL = 6;
/** Pictures between two that stand for themselves. */
const KEY_EVERY = 60;
/** H.264 high profile, level 4.2 and VP9, profile 0: the first that the browser encodes. */
const CODECS = [
  ["avc", "avc1.64002a"],
  ["vp9", "vp09.00.41.08"],
] as const;

/** See the file's head. */
export async function film(app: App, settings: FilmSettings): Promise<string> {
  const canvas = app.view.stage.canvas;
  // encoders of 4:2:0 want even sizes
  const [width, height] = [canvas.width - (canvas.width % 2), canvas.height - (canvas.height % 2)];
  const chosen = await supported(width, height, settings.fps);
  const muxer = new Muxer({
    target: new ArrayBufferTarget(),
    video: { codec: chosen.name, width, height, frameRate: settings.fps },
    fastStart: "in-memory",
  });
  let failed: Error | undefined;
  const encoder = new VideoEncoder({
    output: (chunk, meta) => muxer.addVideoChunk(chunk, meta),
    error: (error) => {
      failed = error;
    },
  });
  encoder.configure(chosen.config);
  const pictures = Math.max(
    1,
    Math.floor(((settings.to - settings.from) / settings.speed) * settings.fps) + 1,
  );
  for (let picture = 0; picture < pictures && !failed; picture++) {
    app.seek(settings.from + (picture * settings.speed) / settings.fps);
    const timestamp = Math.round((picture * 1e6) / settings.fps);
    const visibleRect = { x: 0, y: 0, width, height };
    const frame = new VideoFrame(canvas, {
      timestamp,
      duration: Math.round(1e6 / settings.fps),
      visibleRect,
    });
    encoder.encode(frame, { keyFrame: picture % KEY_EVERY === 0 });
    frame.close();
    while (encoder.encodeQueueSize > 8) await new Promise((resolve) => setTimeout(resolve, 1));
  }
  await encoder.flush();
  if (failed) throw failed;
  muxer.finalize();
  return base64(new Uint8Array(muxer.target.buffer));
}

async function supported(
  width: number,
  height: number,
  framerate: number,
): Promise<{ name: "avc" | "vp9"; config: VideoEncoderConfig }> {
  if (typeof VideoEncoder === "undefined") throw new Error("This browser encodes no films.");
  for (const [name, codec] of CODECS) {
    const bitrate = Math.round(BITS_PER_PIXEL * width * height);
    const config: VideoEncoderConfig = { codec, width, height, framerate, bitrate };
    if ((await VideoEncoder.isConfigSupported(config)).supported) return { name, config };
  }
  throw new Error(`This browser encodes neither H.264 nor VP9 of ${width} × ${height}.`);
}

function base64(bytes: Uint8Array): string {
  let text = "";
  for (let at = 0; at < bytes.length; at += 32768)
    text += String.fromCharCode(...bytes.subarray(at, at + 32768));
  return btoa(text);
}
