// The mutual information of two scans, and the rigid motion that has most of it, by ITK. This header and its source
// file use no Eigen: ITK brings one of its own.
#pragma once
#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "common/core/keep_going.hpp"
#include "common/core/result.hpp"

namespace osteon::imaging {

struct GreyImage {
  std::array<int, 3> dims{};                    // columns, rows, slices
  std::array<double, 3> spacing_mm{};           // between neighbours along each
  std::array<double, 3> origin_mm{};            // centre of the first voxel
  std::array<std::array<double, 3>, 3> axes{};  // directions of columns, rows and slices
  float* values = nullptr;                      // columns fastest; not changed
};

// A point p goes to rotation * p + offset_mm.
struct RigidMotion {
  std::array<std::array<double, 3>, 3> rotation{};  // rows
  std::array<double, 3> offset_mm{};
};

// Both images must live as long as this. Its functions throw no exception.
class MutualInformation {
 public:
  // Compares values at `points_mm` of the fixed image, as far as the moving image reaches them. A motion turns about
  // `centre_mm`. Errors: internal (no point is within both images), exhausted (memory).
  [[nodiscard]] static Result<MutualInformation> between(const GreyImage& fixed, const GreyImage& moving,
                                                         const std::vector<std::array<float, 3>>& points_mm,
                                                         const std::array<double, 3>& centre_mm);
  MutualInformation(MutualInformation&&) noexcept;
  ~MutualInformation();

  // Of the images as they are, nats. Error: internal (no point is within both).
  [[nodiscard]] Result<double> value() const;

  // Goes uphill from no motion, in steps of `step_mm` at first, until they are a thousandth of that or
  // `most_iterations` are done. Points at `radius_mm` from the centre turn by about a step. Returns the motion from the
  // fixed image to the moving one. Errors: cancelled, internal (it left the moving image), exhausted (memory).
  [[nodiscard]] Result<RigidMotion> search(double step_mm, double radius_mm, std::size_t most_iterations,
                                           const KeepGoing& keep_going);

 private:
  struct Impl;
  explicit MutualInformation(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteon::imaging
