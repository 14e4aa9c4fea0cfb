import { existsSync, readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";
import { defineConfig, type Plugin } from "vite";
import { viteSingleFile } from "vite-plugin-singlefile";

/** The engine as `tools/build_playground.sh` compiled it. */
const ENGINE = new URL("../target/wasm/carom_playground.wasm", import.meta.url);
const PLACE = "<!--carom-engine-->";

/** Puts the engine into the page, as base64 of gzip, which holds no character that could end a script. */
function engine(): Plugin {
  return {
    name: "carom-engine",
    transformIndexHtml: {
      order: "post",
      handler: (html) => {
        if (!existsSync(ENGINE))
          throw new Error(`no ${fileURLToPath(ENGINE)}: run tools/build_playground.sh`);
        const packed = gzipSync(readFileSync(ENGINE), { level: 9 }).toString("base64");
        return html.replace(PLACE, () => `<script type="application/carom-engine">${packed}</script>`);
      },
    },
  };
}

// One HTML file with everything inside, as the replay page: no request leaves it.
export default defineConfig({
  plugins: [viteSingleFile({ removeViteModuleLoader: true }), engine()],
  build: {
    outDir: "dist-playground",
    rollupOptions: { input: "playground.html" },
    assetsInlineLimit: 100_000_000,
    chunkSizeWarningLimit: 4_000,
    target: "es2022",
  },
});
