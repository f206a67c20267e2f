// SPDX-License-Identifier: Apache-2.0
#include "fbvins/sim/paint.hpp"

#include "fbvins/sim/painters.hpp"

namespace fbvins {

Canvas paint(Surface surface, Rng& rng) {
  switch (surface) {
    case Surface::plaster: return painters::plaster(rng);
    case Surface::weave: return painters::weave(rng);
    case Surface::concrete: return painters::concrete(rng);
    case Surface::wood: return painters::wood(rng);
    case Surface::brick: return painters::brick(rng);
    case Surface::tiles: return painters::tiles(rng);
    case Surface::carpet: return painters::carpet(rng);
    case Surface::page: return painters::page(rng);
    case Surface::poster: return painters::poster(rng);
    case Surface::picture: return painters::picture(rng);
    case Surface::cardboard: return painters::cardboard(rng);
    case Surface::metal: return painters::metal(rng);
    case Surface::books: return painters::books(rng);
    case Surface::cloth: return painters::cloth(rng);
    case Surface::panel: return painters::panel(rng);
    case Surface::marks: return painters::marks(rng);
    case Surface::checker: return painters::checker(rng);
    case Surface::mat: return painters::mat(rng);
    case Surface::count: break;
  }
  return Canvas{};
}

}  // namespace fbvins
