// SPDX-License-Identifier: Apache-2.0
// Colours with a meaning: health, age and depth of features.

export const HEALTH = { good: "#54c98f", degraded: "#e8b64f", lost: "#f0716c", initialising: "#6ba8ec", none: "#7b8b96" };

const AGE = ["#4fc3f7", "#66d9b8", "#b7dd6a", "#ffd166", "#ff9e57"];
const DEPTH = ["#ff6b6b", "#ffb65c", "#d9e26b", "#5fd0b5", "#5b9bff"];
export const UNKNOWN = "#9aa7b0";
export const OLDEST_IMAGES = 60, NEAREST_M = 0.5, FARTHEST_M = 20;

/// A colour between those of a list; `share` from 0 to 1.
function between(colours, share) {
  const place = Math.min(Math.max(share, 0), 0.9999) * (colours.length - 1);
  const low = Math.floor(place), rest = place - low;
  const [a, b] = [colours[low], colours[low + 1]].map(c => [1, 3, 5].map(i => parseInt(c.slice(i, i + 2), 16)));
  return `rgb(${a.map((value, i) => Math.round(value + (b[i] - value) * rest)).join(",")})`;
}

export function ageColour(images) { return between(AGE, Math.sqrt(images / OLDEST_IMAGES)); }
export function depthColour(metres) {
  if (!(metres > 0)) return UNKNOWN;
  return between(DEPTH, Math.log(metres / NEAREST_M) / Math.log(FARTHEST_M / NEAREST_M));
}
export function gradient(kind) { return `linear-gradient(90deg, ${(kind === "age" ? AGE : DEPTH).join(", ")})`; }
