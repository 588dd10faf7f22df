// Whether a cut would remove metal. No tool cuts metal.
#pragma once
#include <span>

#include "common/field/cut.hpp"
#include "common/tools/cut_body.hpp"
#include "common/volume/cut_field.hpp"

namespace osteon {

// True if the swept tool reaches deeper than h at a metal sample of level 0: T(x) < -h, with T as the cut kernel
// computes it at level 0. Metal must still be there, or beside it, in one of the fields, which belong to one case. One
// voxel is the possible error of a client, which sees metal between samples. A grazed sample still counts, so nobody
// can cut through metal in thin layers. Evaluates only leaves with metal within the box of the sweep, so the cost is at
// most that of the cut at level 0.
[[nodiscard]] bool meets_metal(const Cut& cut, const CutBody& body, std::span<const CutField* const> fields);

}  // namespace osteon
