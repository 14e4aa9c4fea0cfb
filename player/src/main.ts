/** Starts the page with the runs that were put into it. */

import "uplot/dist/uPlot.min.css";
import "./style.css";
import { App } from "./app";
import { readPayloads } from "./data/payload";
import { element } from "./dom";

declare global {
  interface Window {
    /** The page, for programs that drive it; there once it is ready. */
    carom?: App;
    /** Why the page could not start. */
    caromError?: string;
  }
}

async function start(): Promise<void> {
  const host = document.getElementById("app")!;
  try {
    const payloads = await readPayloads();
    if (!payloads.length) throw new Error("This page holds no run; make one with run.to_html(path).");
    window.carom = new App(host, payloads);
  } catch (error) {
    window.caromError = error instanceof Error ? error.message : String(error);
    host.replaceChildren(element("p", { class: "failure" }, window.caromError));
  }
}

void start();
