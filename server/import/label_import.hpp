// From a label volume to a case.
#pragma once
#include <optional>
#include <string>

#include "common/volume/case.hpp"
#include "common/volume/case_scan.hpp"
#include "server/import/label_stack.hpp"

namespace osteon::import {

struct LabelOptions {
  std::optional<double> pitch_mm;  // default: the smallest spacing
  std::string title = "Label volume";
  imaging::SmoothingParams smoothing;
};

struct LabelImport {
  Case bone;
  double labelled_mm3 = 0;  // volume of the bone's voxels; that of `bone` is the volume after smoothing
  CaseScan scan;            // of `bone`: the labels, without HU
};

// Errors: invalid_input (a lattice too large), cancelled.
[[nodiscard]] Result<LabelImport> import_labels(LabelStack stack, const LabelLegend& legend,
                                                const LabelOptions& options, const KeepGoing& keep_going);

}  // namespace osteon::import
