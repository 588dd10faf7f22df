// Converts what is planned and the structures at risk between the protocol's messages and ours.
#pragma once
#include <cstddef>
#include <vector>

#include "common/core/result.hpp"
#include "common/surface/density_grid.hpp"
#include "common/surface/surgical_plan.hpp"
#include "osteon/v1/plan.pb.h"

namespace osteon::wire {

// The stream of a plan, in order. No message is larger than 1 MiB, but for names.
[[nodiscard]] std::vector<v1::GetPlanResponse> to_wire(const SurgicalPlan& plan);

// Puts a plan together from its messages.
class PlanReader {
 public:
  // Error invalid_input for anything that a correct server never sends, and for more than kMostPlanTriangles.
  [[nodiscard]] Result<void> add(const v1::GetPlanResponse& message);
  // Call it after the last message. Error invalid_input: the plan is not complete.
  [[nodiscard]] Result<SurgicalPlan> finish();

 private:
  [[nodiscard]] Result<void> begin(const v1::GetPlanResponse& message);
  [[nodiscard]] Result<void> add(const v1::SurfacePart& part);

  struct Size {
    std::size_t points = 0, triangles = 0;
  };
  SurgicalPlan plan_;
  std::vector<Size> sizes_;  // of the structures' surfaces
  bool begun_ = false, complete_ = false;
};

// The stream of a density.
[[nodiscard]] std::vector<v1::GetDensityResponse> to_wire(const DensityGrid& density);

class DensityReader {
 public:
  // Error invalid_input for anything that a correct server never sends.
  [[nodiscard]] Result<void> add(const v1::GetDensityResponse& message);
  [[nodiscard]] Result<DensityGrid> finish();  // after the last message

 private:
  DensityGrid density_;
  bool begun_ = false, complete_ = false;
};

}  // namespace osteon::wire
