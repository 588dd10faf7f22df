#include "viewer_client/inside/c_arm_image.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace osteon {
namespace {

using radiology::CArm;
using radiology::ConeBeam;
using radiology::PixelBox;
using radiology::Projection;

constexpr double kOne_ugy = 1.0;

CArm coarser_arm(const CArmPosition& position, int coarser) {
  CArm arm = c_arm_at(position);
  arm.columns /= coarser;
  arm.rows /= coarser;
  return arm;
}

bool same_place(const CArm& arm, const CArmPosition& position) {
  return arm.isocentre_mm == position.isocentre_mm && arm.orbit_rad == position.orbit_rad &&
         arm.tilt_rad == position.tilt_rad && arm.translation_mm == position.translation_mm;
}

// The shadows of what is in one of the lists and not in the other.
std::vector<PixelBox> shadows_of_difference(std::span<const PlacedMetal> before, std::span<const PlacedMetal> after,
                                            const ConeBeam& beam) {
  std::vector<PixelBox> boxes;
  const auto add_missing = [&](std::span<const PlacedMetal> from, std::span<const PlacedMetal> in) {
    for (const PlacedMetal& one : from) {
      if (std::ranges::find(in, one) != in.end()) continue;
      const PixelBox shadow = radiology::shadow_of(in_bone_frame(one).solid.bounds, beam);
      if (!shadow.empty()) boxes.push_back(shadow);
    }
  };
  add_missing(before, after);
  add_missing(after, before);
  return boxes;
}

}  // namespace

CArmImage::CArmImage(Shown shown, const radiology::Intensifier& intensifier)
    : shown_(std::move(shown)), intensifier_(intensifier) {}

void CArmImage::make(const ShotOrder& order, std::int64_t time_unix_ms, std::vector<PlacedMetal> metal) {
  CArmShot shot;
  shot.time_unix_ms = time_unix_ms;
  shot.mode = order.mode;
  shot.position = order.position;
  shot.exposure_s = exposure_of(order.mode);
  shot.seed = order.seed;
  make_again(order.id, shot, std::move(metal));
}

void CArmImage::make_again(std::uint64_t id, const CArmShot& shot, std::vector<PlacedMetal> metal) {
  const MutexLock lock(mutex_);
  waiting_ = Request{id, shot, std::move(metal)};
}

void CArmImage::show_maximum(const std::optional<CArmPosition>& position) {
  const MutexLock lock(mutex_);
  maximum_ = position;
}

void CArmImage::drop() {
  const MutexLock lock(mutex_);
  waiting_.reset();
}

bool CArmImage::outdated(const CArmPosition& position, Projection projection) const {
  const MutexLock lock(mutex_);
  if (waiting_ && !(waiting_->shot.position == position)) return true;
  // The whole picture of a shot comes all the same: somebody waits for it.
  return projection == Projection::most && maximum_ && !(*maximum_ == position);
}

// [inside thread]
void CArmImage::paint(const radiology::BoneHu& bone, const InsideChange& change, const KeepGoing& keep_going) {
  note(change);
  std::optional<Request> request;
  std::optional<CArmPosition> maximum;
  {
    const MutexLock lock(mutex_);
    request = std::exchange(waiting_, std::nullopt);
    maximum = maximum_;
  }
  if (request) shoot(bone, std::move(*request), keep_going);
  if (maximum && keep_going(0.95)) show_projection(bone, *maximum, keep_going);
}

void CArmImage::note(const InsideChange& change) {
  changed_.all |= change.all || changed_.boxes.size() + change.boxes.size() > InsideChange::kMostBoxes;
  if (changed_.all)
    changed_.boxes.clear();
  else
    changed_.boxes.insert(changed_.boxes.end(), change.boxes.begin(), change.boxes.end());
}

bool CArmImage::fits(const CArmPosition& position, Projection projection) const {
  return fine_ && !changed_.all && fine_->image.projection() == projection && same_place(fine_->position, position);
}

std::optional<CArmImage::Layers> CArmImage::cast(const radiology::BoneHu& bone, const CArmPosition& position,
                                                 int coarser, Projection projection) const {
  const CArm arm = coarser_arm(position, coarser);
  const Result<ConeBeam> beam = radiology::beam_of(arm);
  if (!beam) return {};
  std::optional<Layers> layers(std::in_place, arm, *beam, projection);
  layers->image.cast(bone);
  if (projection == Projection::attenuation) {
    layers->metal_layer.resize(beam->detector.count());
    layers->photons_of_ugy.resize(beam->detector.count());
  }
  return layers;
}

void CArmImage::renew(Layers& layers, const std::vector<PlacedMetal>& metal, std::vector<PixelBox> changed) const {
  const ConeBeam& beam = layers.image.beam();
  const std::vector<PixelBox> moved = shadows_of_difference(layers.metal, metal, beam);
  std::vector<radiology::MetalSolid> solids;
  if (!moved.empty()) std::ranges::transform(metal, std::back_inserter(solids), in_bone_frame);
  for (const PixelBox& box : moved) radiology::cast_metal(beam, solids, box, layers.metal_layer);
  layers.metal = metal;
  changed.insert(changed.end(), moved.begin(), moved.end());
  for (const PixelBox& box : changed)
    radiology::count_photons(beam, {layers.image.values(), layers.metal_layer}, {kOne_ugy}, intensifier_, box,
                             layers.photons_of_ugy);
}

void CArmImage::shoot(const radiology::BoneHu& bone, const Request& request, const KeepGoing& keep_going) {
  CArmShot shot = request.shot;
  if (fits(shot.position, Projection::attenuation)) {
    const std::vector<PixelBox> changed = fine_->image.recast(bone, changed_.boxes);
    changed_ = {};
    renew(*fine_, request.metal, changed);
    return show_shot(*fine_, shot, request.id, false);
  }
  fine_.reset();
  std::optional<Layers> coarse = cast(bone, shot.position, kCoarser, Projection::attenuation);
  if (!coarse) return;
  renew(*coarse, request.metal, {coarse->image.beam().detector.whole()});
  show_shot(*coarse, shot, request.id, true);
  if (!keep_going(0.5) || outdated(shot.position, Projection::attenuation)) return;
  fine_ = cast(bone, shot.position, 1, Projection::attenuation);
  changed_ = {};
  if (!keep_going(0.9)) return;
  renew(*fine_, request.metal, {fine_->image.beam().detector.whole()});
  show_shot(*fine_, shot, request.id, false);
}

void CArmImage::show_projection(const radiology::BoneHu& bone, const CArmPosition& position,
                                const KeepGoing& keep_going) {
  if (fits(position, Projection::most)) {
    if (changed_.boxes.empty()) return;
    (void)fine_->image.recast(bone, changed_.boxes);
    changed_ = {};
    return show_maximum_of(*fine_, false);
  }
  fine_.reset();
  const std::optional<Layers> coarse = cast(bone, position, kCoarser, Projection::most);
  if (!coarse) return;
  show_maximum_of(*coarse, true);
  if (!keep_going(0.5) || outdated(position, Projection::most)) return;
  fine_ = cast(bone, position, 1, Projection::most);
  changed_ = {};
  show_maximum_of(*fine_, false);
}

// The first picture of a new shot sets its kerma and dose, because its photons are there once.
void CArmImage::show_shot(const Layers& layers, CArmShot& shot, std::uint64_t order, bool coarse) const {
  const ConeBeam& beam = layers.image.beam();
  if (shot.air_kerma_at_metre_ugy == 0.0) {
    const radiology::Exposure exposure =
        radiology::controlled_exposure(beam, {layers.image.values(), layers.metal_layer}, intensifier_, {});
    shot.air_kerma_at_metre_ugy = exposure.air_kerma_at_metre_ugy;
    shot.dose_area_gy_cm2 = radiology::dose_area_gy_cm2(beam, exposure);
  }
  std::vector<float> photons = layers.photons_of_ugy;
  for (float& count : photons) count *= static_cast<float>(shot.air_kerma_at_metre_ugy / kOne_ugy);
  radiology::add_quantum_noise(beam.detector, beam.detector.whole(), shot.seed, photons);
  radiology::add_glare(beam.detector, intensifier_, photons);
  auto picture = std::make_shared<CArmPicture>();
  picture->order = order;
  picture->shot = shot;
  picture->coarse = coarse;
  picture->columns = beam.detector.columns;
  picture->rows = beam.detector.rows;
  picture->letters = edge_letters(beam.detector.column_mm, beam.detector.row_mm);
  picture->contrast = radiology::automatic_window(photons);
  picture->grey = radiology::grey_of(photons, picture->contrast);
  shown_(std::move(picture));
}

// Dense matter is white, as in other maximum intensity projections.
void CArmImage::show_maximum_of(const Layers& layers, bool coarse) const {
  auto picture = std::make_shared<CArmPicture>();
  picture->coarse = coarse;
  picture->columns = layers.image.beam().detector.columns;
  picture->rows = layers.image.beam().detector.rows;
  const radiology::PixelGrid& detector = layers.image.beam().detector;
  picture->letters = edge_letters(detector.column_mm, detector.row_mm);
  picture->grey.resize(layers.image.values().size());
  std::ranges::transform(layers.image.values(), picture->grey.begin(), [](float hu) {
    return static_cast<std::uint8_t>(
        std::lround(255.0f * std::clamp((hu - kBlack_hu) / (kWhite_hu - kBlack_hu), 0.0f, 1.0f)));
  });
  shown_(std::move(picture));
}

}  // namespace osteon
