#include "common/imaging/thin_cortex.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <unordered_map>
#include <vector>

#include "common/imaging/calibration.hpp"
#include "common/imaging/cortex_profile.hpp"
#include "common/imaging/resample.hpp"

namespace osteon::imaging {
namespace {

constexpr double kOutside_sigmas = 2.5;                   // how far a profile reaches out of the bone
constexpr double kWindow_sigmas = 4.0, kWindow_mm = 2.5;  // how far into it, at first
constexpr double kDeep_mm = 12.0;                         // and if cortex is thicker than that shows
constexpr double kShown = 0.6;                            // of the window: thicker cortex needs the deeper one
constexpr double kPlate_sigmas = 7.0;                     // bone up to that width may be a plate
constexpr double kSteps_of_sigma = 0.3;                   // of a profile
constexpr double kMostRest = 0.08;    // of a fit, as a part of the cortex's height over what is beside it
constexpr double kFade_sigmas = 3.0;  // the blur of an edge ends there
constexpr double kTooDense = 1.1;     // of compact bone: metal or enamel is near
// Cortex whose density is measured: its least thickness, the densities that are believed, and how many points do.
constexpr double kThick_sigmas = 3.0, kLeastCortex_g_cm3 = 1.5, kThickRest = 0.05;
constexpr std::size_t kEnoughThick = 200;
constexpr int kOneOf = 16;  // points that are asked for the cortex's density

// A point of the surface.
struct SurfacePoint {
  Vec3 at_mm;       // LPS
  Vec3 inwards;     // unit vector
  double sigma_mm;  // of the scan along it
  double width_mm;  // of the bone below it, at most kDeep_mm
};

struct PointFit {
  CortexProfile profile;  // from the point inwards
  bool plate = false;
  double reach_mm = 0.0;  // of the change
};

class Corrector {
 public:
  Corrector(const HuVolume& volume, const SparseVolume& surface_mm, double pitch_mm,
            const DensityCalibration& calibration)
      : volume_(volume),
        surface_mm_(surface_mm),
        pitch_mm_(pitch_mm),
        calibration_(calibration),
        most_hu_(kTooDense * hounsfield(calibration, kCompactBone_g_cm3)) {}

  Result<CortexCorrection> run(const KeepGoing& keep_going);

 private:
  [[nodiscard]] double depth_mm(const Vec3& at_mm) const { return -surface_mm_.trilinear(at_mm / pitch_mm_); }
  [[nodiscard]] std::optional<SurfacePoint> point_at(Coord sample) const;
  bool read_line(const SurfacePoint& point, double from_mm, double to_mm);
  [[nodiscard]] std::optional<CortexFit> sound(std::optional<CortexFit> fit) const;
  std::optional<PointFit> fit(const SurfacePoint& point);
  std::optional<PointFit> fit_plate(const SurfacePoint& point);
  std::optional<PointFit> fit_layer(const SurfacePoint& point);
  [[nodiscard]] double change_hu(const PointFit& fit, double depth_mm) const;
  void add_change(const SurfacePoint& point, const PointFit& fit);
  void measure_cortex(const std::vector<Coord>& samples);
  Result<std::vector<Coord>> samples_beside_surface(const KeepGoing& keep_going) const;

  // Weighted changes of the samples of a leaf.
  struct LeafChange {
    std::array<float, kLeafVoxels> sum{}, weight{};
  };

  const HuVolume& volume_;
  const SparseVolume& surface_mm_;
  double pitch_mm_;
  DensityCalibration calibration_;
  double most_hu_;
  PointSpread spread_;
  double cortex_hu_ = 0.0;
  bool cortex_measured_ = false;
  std::vector<double> hu_;
  LineOfHu line_;
  std::unordered_map<Coord, LeafChange, CoordHash> changes_;
};

// The samples in bone that are less than a pitch from its surface.
Result<std::vector<Coord>> Corrector::samples_beside_surface(const KeepGoing& keep_going) const {
  std::vector<Coord> samples;
  const std::vector<Coord> leaves = surface_mm_.leaves();
  for (std::size_t n = 0; n < leaves.size(); ++n) {
    if (n % 1024 == 0 && !keep_going(static_cast<double>(n) / static_cast<double>(leaves.size())))
      return stopped_while("looking for thin cortex");
    const float* s = surface_mm_.leaf(leaves[n]);
    for (int i = 0; i < kLeafVoxels; ++i) {
      if (s[i] > 0.0f || s[i] <= -static_cast<float>(pitch_mm_)) continue;
      samples.push_back(leaves[n] + Coord{i / (kLeafSize * kLeafSize), i / kLeafSize % kLeafSize, i % kLeafSize});
    }
  }
  return samples;
}

// The point of the surface that is nearest to a sample.
std::optional<SurfacePoint> Corrector::point_at(Coord sample) const {
  const auto s = [&](int x, int y, int z) { return static_cast<double>(surface_mm_.value(sample + Coord{x, y, z})); };
  const Vec3 slope(s(1, 0, 0) - s(-1, 0, 0), s(0, 1, 0) - s(0, -1, 0), s(0, 0, 1) - s(0, 0, -1));
  const double steepness = slope.norm() / (2.0 * pitch_mm_);
  if (steepness < 0.5) return {};  // the middle of a plate or an edge
  SurfacePoint point;
  point.inwards = -slope.normalized();
  point.at_mm = position_mm(sample, pitch_mm_) + point.inwards * s(0, 0, 0);
  point.sigma_mm = spread_.along_mm(volume_.directions.transpose() * point.inwards);
  point.width_mm = kDeep_mm;
  const double step_mm = 0.5 * pitch_mm_;
  for (double at = pitch_mm_; at < kDeep_mm; at += step_mm)
    if (const double depth = depth_mm(point.at_mm + at * point.inwards); depth < 0.0) {
      point.width_mm = at + depth;
      break;
    }
  return point;
}

// False if something is too dense for bone.
bool Corrector::read_line(const SurfacePoint& point, double from_mm, double to_mm) {
  line_.step_mm = kSteps_of_sigma * point.sigma_mm;
  const int steps = std::max(1, static_cast<int>(std::lround((to_mm - from_mm) / line_.step_mm)));
  line_.first_mm = from_mm;
  hu_.clear();
  for (int i = 0; i <= steps; ++i) {
    hu_.push_back(hu_at(volume_, volume_.voxel(point.at_mm + (from_mm + i * line_.step_mm) * point.inwards)));
    if (hu_.back() > most_hu_) return false;
  }
  line_.hu = hu_;
  return true;
}

std::optional<CortexFit> Corrector::sound(std::optional<CortexFit> fit) const {
  if (!fit) return {};
  const CortexProfile& p = fit->profile;
  const double height = p.cortex_hu - std::min(p.outside_hu, p.inside_hu);
  return p.cortex_hu > std::max(p.outside_hu, p.inside_hu) && fit->rest_hu <= kMostRest * height ? fit : std::nullopt;
}

std::optional<PointFit> Corrector::fit(const SurfacePoint& point) {
  // A thin bone is a plate if it can be one. A thicker one is a plate if it is cortex throughout.
  const bool thin = point.width_mm < kPlate_sigmas * point.sigma_mm;
  if (thin)
    if (const auto plate = fit_plate(point)) return plate;
  if (const auto layer = fit_layer(point)) return layer;
  return thin || point.width_mm >= kDeep_mm ? std::nullopt : fit_plate(point);
}

std::optional<PointFit> Corrector::fit_plate(const SurfacePoint& point) {
  const double outside_mm = kOutside_sigmas * point.sigma_mm;
  if (!read_line(point, -outside_mm, point.width_mm + outside_mm)) return {};
  const auto found = sound(fit_cortex(line_, point.sigma_mm, cortex_hu_));
  if (!found) return {};
  return PointFit{found->profile, true, 0.5 * point.width_mm + pitch_mm_};
}

// Cortex on something else. The profile ends in the middle of the bone, before the cortex of the other side.
std::optional<PointFit> Corrector::fit_layer(const SurfacePoint& point) {
  const double deep_mm = point.width_mm < kDeep_mm ? 0.5 * point.width_mm : kDeep_mm;
  for (const double wanted_mm : {kWindow_sigmas * point.sigma_mm + kWindow_mm, kDeep_mm}) {
    const double to_mm = std::min(deep_mm, wanted_mm);
    if (!read_line(point, -kOutside_sigmas * point.sigma_mm, to_mm)) return {};
    const auto found = sound(fit_cortex(line_, point.sigma_mm, cortex_hu_));
    if (found && found->profile.outer_mm + found->profile.thickness_mm < kShown * to_mm) {
      const CortexProfile& p = found->profile;
      return PointFit{p, false,
                      std::min(deep_mm, std::max(0.0, p.outer_mm) + p.thickness_mm + kFade_sigmas * point.sigma_mm)};
    }
    if (to_mm == deep_mm) return {};
  }
  return {};
}

// Of a sample: the mean over a pitch of the profile without blur, less the profile with it. Beyond the surface, cortex
// goes on, because only the surface says where bone ends.
double Corrector::change_hu(const PointFit& fit, double depth_mm) const {
  const CortexProfile& p = fit.profile;
  const double low = depth_mm - 0.5 * pitch_mm_, high = depth_mm + 0.5 * pitch_mm_;
  const double outer = fit.plate ? p.outer_mm : low, inner = (fit.plate ? p.outer_mm : 0.0) + p.thickness_mm;
  const auto share = [&](double from, double to) {
    return std::max(0.0, std::min(high, to) - std::max(low, from)) / pitch_mm_;
  };
  const double sharp =
      p.outside_hu * share(low, outer) + p.cortex_hu * share(outer, inner) + p.inside_hu * share(inner, high);
  return sharp - p.blurred_hu(depth_mm);
}

void Corrector::add_change(const SurfacePoint& point, const PointFit& fit) {
  constexpr double kBeyond_pitches = 1.5;  // samples outside the bone, from which the density beside it is interpolated
  const double step_mm = 0.5 * pitch_mm_, width2 = 0.25 * pitch_mm_ * pitch_mm_;
  for (double at = -kBeyond_pitches * pitch_mm_; at <= fit.reach_mm; at += step_mm) {
    const Vec3 index = (point.at_mm + at * point.inwards) / pitch_mm_;
    const Coord low{static_cast<std::int32_t>(std::floor(index.x())), static_cast<std::int32_t>(std::floor(index.y())),
                    static_cast<std::int32_t>(std::floor(index.z()))};
    for (int corner = 0; corner < 8; ++corner) {
      const Coord sample = low + Coord{corner & 1, corner >> 1 & 1, corner >> 2};
      const Vec3 from = position_mm(sample, pitch_mm_) - point.at_mm;
      const double depth_mm = from.dot(point.inwards);
      const double weight = std::exp(-(from - depth_mm * point.inwards).squaredNorm() / (2.0 * width2));
      const Coord origin = floor_to(sample, kLeafSize);
      LeafChange& leaf = changes_[origin];
      const Coord in = sample - origin;
      const auto i = static_cast<std::size_t>((in.x * kLeafSize + in.y) * kLeafSize + in.z);
      leaf.sum[i] += static_cast<float>(weight * change_hu(fit, depth_mm));
      leaf.weight[i] += static_cast<float>(weight);
    }
  }
}

// The HU of cortex where it is thick enough to show them, or else those of the usual density.
void Corrector::measure_cortex(const std::vector<Coord>& samples) {
  cortex_hu_ = hounsfield(calibration_, kCortical_g_cm3);
  const double least_hu = hounsfield(calibration_, kLeastCortex_g_cm3),
               most_hu = hounsfield(calibration_, kCompactBone_g_cm3);
  std::vector<double> thick;
  for (std::size_t i = 0; i < samples.size(); i += kOneOf) {
    const auto point = point_at(samples[i]);
    if (!point || !read_line(*point, -kOutside_sigmas * point->sigma_mm,
                             point->width_mm < kDeep_mm ? 0.5 * point->width_mm : kDeep_mm))
      continue;
    const auto found = fit_thick_cortex(line_, point->sigma_mm, cortex_hu_);
    if (!found) continue;
    const CortexProfile& p = found->profile;
    if (p.thickness_mm > kThick_sigmas * point->sigma_mm && p.cortex_hu >= least_hu && p.cortex_hu <= most_hu &&
        p.cortex_hu > std::max(p.outside_hu, p.inside_hu) &&
        found->rest_hu < kThickRest * (p.cortex_hu - std::min(p.outside_hu, p.inside_hu)))
      thick.push_back(p.cortex_hu);
  }
  if (thick.size() * kOneOf < kEnoughThick) return;
  std::ranges::nth_element(thick, thick.begin() + static_cast<std::ptrdiff_t>(thick.size() / 2));
  cortex_hu_ = thick[thick.size() / 2];
  cortex_measured_ = true;
}

Result<CortexCorrection> Corrector::run(const KeepGoing& keep_going) {
  const auto spread = measure_point_spread(volume_, part(keep_going, 0.0, 0.1));
  if (!spread) return tl::unexpected(spread.error());
  spread_ = *spread;
  const auto samples = samples_beside_surface(part(keep_going, 0.1, 0.15));
  if (!samples) return tl::unexpected(samples.error());
  measure_cortex(*samples);
  CortexCorrection made;
  made.spread = spread_;
  made.cortex_hu = cortex_hu_;
  made.cortex_measured = cortex_measured_;
  std::vector<float> thickness_mm;
  for (std::size_t i = 0; i < samples->size(); ++i) {
    if (i % 1024 == 0 && !keep_going(0.2 + 0.75 * static_cast<double>(i) / static_cast<double>(samples->size())))
      return stopped_while("fitting thin cortex");
    const auto point = point_at((*samples)[i]);
    if (!point) continue;
    ++made.points;
    const auto found = fit(*point);
    if (!found) continue;
    ++made.corrected;
    thickness_mm.push_back(static_cast<float>(found->profile.thickness_mm));
    add_change(*point, *found);
  }
  for (const auto& [origin, leaf] : changes_) {
    float* to = made.change_hu.edit_leaf(origin);
    for (std::size_t i = 0; i < leaf.sum.size(); ++i)
      if (leaf.weight[i] > 0.0f) to[i] = leaf.sum[i] / leaf.weight[i];
  }
  std::ranges::sort(thickness_mm);
  for (int i = 0; i < 3 && !thickness_mm.empty(); ++i)
    made.thickness_mm[i] = static_cast<double>(thickness_mm[(thickness_mm.size() - 1) *
                                                            (i == 0   ? 1
                                                             : i == 1 ? 5
                                                                      : 9) /
                                                            10]);
  if (!keep_going(1.0)) return stopped_while("fitting thin cortex");
  return made;
}

}  // namespace

Result<CortexCorrection> correct_thin_cortex(const HuVolume& volume, const SparseVolume& surface_mm, double pitch_mm,
                                             const DensityCalibration& calibration, const KeepGoing& keep_going) {
  return Corrector(volume, surface_mm, pitch_mm, calibration).run(keep_going);
}

}  // namespace osteon::imaging
