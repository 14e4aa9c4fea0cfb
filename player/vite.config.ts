import { createHash } from "node:crypto";
import { readdirSync, readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { defineConfig, type Plugin } from "vite";
import { viteSingleFile } from "vite-plugin-singlefile";

/** What the page is made of, besides the folder src. */
const FILES = ["index.html", "package-lock.json", "vite.config.ts"];

/** A digest of all sources; `tests/contracts/test_player_page.py` computes it again from the same list. */
function digest(): string {
  const root = new URL(".", import.meta.url);
  const names = readdirSync(new URL("src", root), { recursive: true, withFileTypes: true })
    .filter((entry) => entry.isFile())
    .map((entry) => `${entry.parentPath.slice(fileURLToPath(root).length)}/${entry.name}`);
  const hash = createHash("sha256");
  for (const name of [...names, ...FILES].sort()) {
    hash
      .update(`${name}\0`)
      .update(readFileSync(new URL(name, root)))
      .update("\0");
  }
  return hash.digest("hex");
}

/** Writes the digest into the page, so that a stale page is found without building it. */
function sources(): Plugin {
  return {
    name: "carom-sources",
    transformIndexHtml: () => [
      { tag: "meta", attrs: { name: "carom-sources", content: digest() }, injectTo: "head" },
    ],
  };
}

// One HTML file with everything inside: no request leaves the page.
export default defineConfig({
  plugins: [sources(), viteSingleFile({ removeViteModuleLoader: true })],
  build: {
    outDir: "dist",
    assetsInlineLimit: 100_000_000,
    chunkSizeWarningLimit: 4_000,
    target: "es2022",
  },
});
