#include "haptic_client/simulation/entry_site.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace osteon::haptic {
namespace {

constexpr double kReach_mm = 60.0;
constexpr double kLargestGap_mm = 3.0;  // diploe below the threshold is still one bone
constexpr double kNormalRadius_mm = 3.0;
constexpr double kRings_mm = 2.0;  // between lines that look for bone

std::string shown_position(const Vec3& v) {
  char text[96];
  std::snprintf(text, sizeof text, "(%.1f, %.1f, %.1f)", v.x(), v.y(), v.z());
  return text;
}

void set_across(EntrySite& site) {
  const Vec3 helper = std::abs(site.axis.z()) < 0.9 ? Vec3::UnitZ() : Vec3::UnitX();
  site.across_u = site.axis.cross(helper).normalized();
  site.across_v = site.axis.cross(site.across_u);
}

double thickness_mm(const Case& bone, const EntrySite& site) {
  const double step_mm = 0.2 * bone.pitch_mm();
  double last_bone_mm = 0.0;
  for (double at = step_mm; at < 200.0 && at - last_bone_mm < kLargestGap_mm; at += step_mm)
    if (bone.surface_mm(site.entry_mm + at * site.axis) < 0.0) last_bone_mm = at;
  return last_bone_mm;
}

EntrySite facing(const Vec3& axis) {
  EntrySite site;
  site.axis = axis;
  set_across(site);
  return site;
}

// Direction of the surface around the entry: the plane through the points where parallel lines beside it meet bone.
void refine(const Case& bone, EntrySite& site) {
  std::vector<Vec3> hits;
  constexpr double kBack_mm = 4.0;
  for (int ring = 1; ring <= 3; ++ring)
    for (int i = 0; i < 6 * ring; ++i) {
      const double angle = 2.0 * 3.14159265358979 * i / (6 * ring), radius = kNormalRadius_mm * ring / 3.0;
      const Vec3 from = site.entry_mm + radius * (std::cos(angle) * site.across_u + std::sin(angle) * site.across_v) -
                        kBack_mm * site.axis;
      const double distance = distance_to_bone_mm(bone, from, site.axis, 2.0 * kBack_mm);
      if (distance >= 0.0) hits.push_back(from + distance * site.axis);
    }
  if (hits.size() < 12) return;
  Vec3 centre = Vec3::Zero();
  for (const Vec3& hit : hits) centre += hit / static_cast<double>(hits.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vec3& hit : hits) spread += (hit - centre) * (hit - centre).transpose() / static_cast<double>(hits.size());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
  const Vec3 normal = axes.eigenvectors().col(0);
  site.axis = normal.dot(site.axis) > 0.0 ? normal : Vec3(-normal);
  site.flatness_mm = std::sqrt(std::max(0.0, axes.eigenvalues()[0]));
  set_across(site);
}

}  // namespace

namespace {

// Puts the site where a line along its axis through a point first meets bone. False: it meets none.
bool meet(const Case& bone, const Vec3& through_mm, EntrySite& site) {
  const double far_mm = bone.bounds().size_mm().norm();
  const Vec3 from = through_mm - far_mm * site.axis;
  const double distance = distance_to_bone_mm(bone, from, site.axis, 2.0 * far_mm);
  if (distance < 0.0) return false;
  site.entry_mm = from + distance * site.axis;
  refine(bone, site);
  site.thickness_mm = thickness_mm(bone, site);
  return true;
}

}  // namespace

double distance_to_bone_mm(const Case& bone, const Vec3& from_mm, const Vec3& axis, double reach_mm) {
  const double least_mm = 0.1 * bone.pitch_mm();
  double at = 0.0, before = 0.0;
  while (at <= reach_mm) {
    const Vec3 point = from_mm + at * axis;
    const double distance = bone.surface_mm(point);
    if (distance < 0.0) {
      // Bisects between the last point outside and this one.
      double low = before, high = at;
      for (int i = 0; i < 30; ++i) {
        const double middle = 0.5 * (low + high);
        (bone.surface_mm(from_mm + middle * axis) < 0.0 ? high : low) = middle;
      }
      return 0.5 * (low + high);
    }
    before = at;
    at += std::max({least_mm, 0.8 * distance, bone.clearance_mm(point)});
  }
  return -1.0;
}

Result<EntrySite> find_site_toward(const Case& bone, const Vec3& toward) {
  if (!(toward.norm() > 1e-9))
    return failure(ErrorCode::invalid_input, "entry.toward must not be zero; give a direction such as [0, 0, 1]");
  EntrySite site = facing(-toward.normalized());
  if (!meet(bone, bone.bounds().centre_mm(), site))
    return failure(ErrorCode::invalid_input,
                   "no bone lies along entry.toward " + shown_position(toward) + "; choose another direction");
  return site;
}

Result<EntrySite> find_site_facing(const Case& bone, const Vec3& toward) {
  const Box box = bone.bounds();
  const double half_mm = 0.5 * box.size_mm().norm();
  EntrySite site = facing(-toward.normalized());
  const Vec3 u = site.across_u, v = site.across_v;
  for (int ring = 0; ring * kRings_mm <= half_mm; ++ring)
    for (int i = 0; i < std::max(1, 6 * ring); ++i) {
      const double angle = 2.0 * std::numbers::pi * i / std::max(1, 6 * ring), radius_mm = ring * kRings_mm;
      const Vec3 beside_mm = radius_mm * (std::cos(angle) * u + std::sin(angle) * v);
      if (meet(bone, box.centre_mm() + beside_mm, site)) return site;
    }
  return failure(ErrorCode::invalid_input, "the case has no bone; import one with a lower --threshold");
}

Result<EntrySite> find_site_at(const Case& bone, const Vec3& point_mm, const Vec3& axis) {
  if (!(axis.norm() > 1e-9))
    return failure(
        ErrorCode::invalid_input,
        "entry.axis must not be zero, nor entry.target_mm at entry.point_mm; give the direction into the bone");
  EntrySite site;
  site.axis = axis.normalized();
  set_across(site);
  const Vec3 from = point_mm - 0.5 * kReach_mm * site.axis;
  const double distance = distance_to_bone_mm(bone, from, site.axis, kReach_mm);
  if (distance < 0.0)
    return failure(ErrorCode::invalid_input, "no bone lies within 30 mm of entry.point_mm " + shown_position(point_mm) +
                                                 " along entry.axis or towards entry.target_mm");
  site.entry_mm = from + distance * site.axis;
  EntrySite flat = site;
  refine(bone, flat);
  site.flatness_mm = flat.flatness_mm;
  site.thickness_mm = thickness_mm(bone, site);
  return site;
}

Result<EntrySite> find_site_beside(const Case& bone, const EntrySite& beside, double u_mm, double v_mm) {
  EntrySite site = beside;
  constexpr double kBack_mm = 15.0;
  const Vec3 from = beside.entry_mm + u_mm * beside.across_u + v_mm * beside.across_v - kBack_mm * beside.axis;
  const double distance = distance_to_bone_mm(bone, from, beside.axis, 2.0 * kBack_mm);
  if (distance < 0.0)
    return failure(ErrorCode::invalid_input,
                   "no bone lies beside the last entry at entry.beside_last_mm; choose a smaller step");
  site.entry_mm = from + distance * beside.axis;
  refine(bone, site);
  site.thickness_mm = thickness_mm(bone, site);
  return site;
}

}  // namespace osteon::haptic
