#include "viewer_client/inside/slice_painter.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/radiology/slice.hpp"

namespace osteon {
namespace {

bool same(const radiology::PixelGrid& a, const radiology::PixelGrid& b) {
  return a.first_mm == b.first_mm && a.column_mm == b.column_mm && a.row_mm == b.row_mm && a.columns == b.columns &&
         a.rows == b.rows;
}

}  // namespace

bool reaches(const CoordBox& samples, double pitch_mm, const radiology::PixelGrid& plane) {
  const Vec3 low = position_mm(samples.min, pitch_mm), high = position_mm(samples.max, pitch_mm);
  const Vec3 half = 0.5 * (high - low) + Vec3::Constant(pitch_mm);
  const Vec3 normal = normal_of(plane);
  return std::abs(depth_mm(plane, 0.5 * (low + high))) <= half.dot(normal.cwiseAbs());
}

void SlicePainter::ask(const std::array<radiology::PixelGrid, kSlices>& planes) {
  const MutexLock lock(mutex_);
  wanted_ = planes;
}

SliceImages SlicePainter::newest() const {
  const MutexLock lock(mutex_);
  return newest_;
}

void SlicePainter::clear() {
  const MutexLock lock(mutex_);
  newest_ = {};
}

void SlicePainter::paint(const radiology::BoneHu& bone, const InsideChange& change, const KeepGoing& keep_going) {
  std::array<radiology::PixelGrid, kSlices> wanted;
  SliceImages images;
  {
    const MutexLock lock(mutex_);
    wanted = wanted_;
    images = newest_;
  }
  bool any = false;
  for (std::size_t i = 0; i < kSlices; ++i) {
    const bool cut = change.all || std::ranges::any_of(change.boxes, [&](const CoordBox& box) {
                       return reaches(box, bone.pitch_mm(), wanted[i]);
                     });
    if (wanted[i].count() == 0 || (images[i] && !cut && same(images[i]->plane, wanted[i]))) continue;
    if (!keep_going(static_cast<double>(i) / kSlices)) return;
    auto image = std::make_shared<SliceImage>(SliceImage{wanted[i], std::vector<float>(wanted[i].count())});
    radiology::sample_slice(bone, image->plane, image->hu);
    images[i] = std::move(image);
    any = true;
  }
  if (!any) return;
  {
    const MutexLock lock(mutex_);
    newest_ = images;
  }
  painted_();
}

}  // namespace osteon
