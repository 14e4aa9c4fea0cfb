/** Starts the playground. */

import "uplot/dist/uPlot.min.css";
import "../src/style.css";
import "./playground.css";
import { element } from "../src/dom";
import { Playground } from "./app";
import { Engine } from "./engine";
import { unpacked } from "./share";

declare global {
  interface Window {
    /** The page, for programs that drive it; there once it is ready. */
    playground?: Playground;
  }
}

async function start(): Promise<void> {
  const host = document.getElementById("app")!;
  try {
    const page = new Playground(host, await Engine.start());
    await page.open(() => unpacked(location.hash));
    window.addEventListener("hashchange", () => void page.open(() => unpacked(location.hash)));
    window.playground = page;
  } catch (error) {
    window.caromError = error instanceof Error ? error.message : String(error);
    host.replaceChildren(element("p", { class: "failure" }, window.caromError));
  }
}

void start();
