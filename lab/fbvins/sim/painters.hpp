// SPDX-License-Identifier: Apache-2.0
// One generator for each Surface, described in paint.hpp. Private to paint*.cpp; pure functions.
#pragma once

#include "fbvins/core/rng.hpp"
#include "fbvins/sim/texture.hpp"

namespace fbvins::painters {

Canvas plaster(Rng& rng);
Canvas weave(Rng& rng);
Canvas concrete(Rng& rng);
Canvas wood(Rng& rng);
Canvas brick(Rng& rng);
Canvas tiles(Rng& rng);
Canvas carpet(Rng& rng);
Canvas cardboard(Rng& rng);
Canvas metal(Rng& rng);
Canvas cloth(Rng& rng);
Canvas page(Rng& rng);
Canvas poster(Rng& rng);
Canvas picture(Rng& rng);
Canvas books(Rng& rng);
Canvas panel(Rng& rng);
Canvas marks(Rng& rng);
Canvas checker(Rng& rng);
Canvas mat(Rng& rng);

}  // namespace fbvins::painters
