// Whether a cut would take metal away, which no tool does.
#pragma once
#include <span>

#include "common/field/cut.hpp"
#include "common/tools/cut_body.hpp"
#include "common/volume/cut_field.hpp"

namespace osteon {

// True where the swept tool reaches deeper than h at a sample of level 0 that is metal, T(x) < -h with T as the cut
// kernel computes it at level 0, and metal is still there or beside it in one of the fields, which are of one case. A
// voxel is what a client may be off, which sees metal between samples. What was grazed so still counts: nobody goes on
// through metal by shaving it. Evaluates only leaves with metal within the box of the sweep, so at most what the cut
// costs at level 0.
[[nodiscard]] bool meets_metal(const Cut& cut, const CutBody& body, std::span<const CutField* const> fields);

}  // namespace osteon
