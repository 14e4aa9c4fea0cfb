/** Scenes to choose from: texts that can be read and changed, and the engine's own by name. */

import firstPlanar from "../../python/carom/scenes/first_steps_planar.toml?raw";
import firstSpatial from "../../python/carom/scenes/first_steps_spatial.toml?raw";
import seven from "../../python/carom/scenes/seven_objects_from_file.toml?raw";
import pile from "./scenes/pile_500.toml?raw";
import pileSpatial from "./scenes/pile_500_spatial.toml?raw";

/** A scene that is known by name; without a text the engine builds it. */
export interface Choice {
  name: string;
  label: string;
  text?: string;
}

/** Scenes with their texts. */
export const TEXTS: readonly Choice[] = [
  { name: "first_steps_planar", label: "first steps in the plane", text: firstPlanar },
  { name: "first_steps_spatial", label: "first steps in space", text: firstSpatial },
  { name: "seven_objects_from_file", label: "seven objects", text: seven },
  { name: "pile_500", label: "500 bodies in the plane", text: pile },
  { name: "pile_500_spatial", label: "500 cubes", text: pileSpatial },
];
