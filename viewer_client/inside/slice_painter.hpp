// Samples slices of the bone's inside, away from the thread that shows them.
#pragma once
#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "common/core/mutex.hpp"
#include "viewer_client/inside/inside_bone.hpp"
#include "viewer_client/inside/slice_planes.hpp"

namespace osteon {

struct SliceImage {
  radiology::PixelGrid plane;
  std::vector<float> hu;  // row by row
};
// Shared with who shows them. Null: not sampled yet.
using SliceImages = std::array<std::shared_ptr<const SliceImage>, kSlices>;

// Any thread may ask for planes and take the newest images.
class SlicePainter final : public InsidePainter {
 public:
  // `painted` is called on the inside thread when there are new images.
  explicit SlicePainter(std::function<void()> painted) : painted_(std::move(painted)) {}

  // The planes that are wanted from now on. Only the newest counts. InsideBone::wake() has them sampled.
  void ask(const std::array<radiology::PixelGrid, kSlices>& planes);
  [[nodiscard]] SliceImages newest() const;
  // For a new bone: nothing of the last one is left.
  void clear();

  void paint(const radiology::BoneHu& bone, const InsideChange& change, const KeepGoing& keep_going) override;

 private:
  const std::function<void()> painted_;
  mutable Mutex mutex_{LockRank::leaf};
  std::array<radiology::PixelGrid, kSlices> wanted_ OSTEON_GUARDED_BY(mutex_);
  SliceImages newest_ OSTEON_GUARDED_BY(mutex_);
};

// Whether a box of samples reaches the image: within a pitch of its plane, as far as trilinear sampling reads.
[[nodiscard]] bool reaches(const CoordBox& samples, double pitch_mm, const radiology::PixelGrid& plane);

}  // namespace osteon
