#include "haptic_client/contact/partner_contact.hpp"

#include <algorithm>
#include <cmath>

namespace osteon::haptic {

TouchPoints::TouchPoints(const Tool& tool, int most) {
  std::vector<SamplePoint> samples = sample_points(tool, std::max(1, most / 2));
  // Takes every n-th point where a long shank has many more than its cutting part; neighbours follow each other.
  const auto room = static_cast<std::size_t>(std::max(1, most));
  const std::size_t every = std::max<std::size_t>(1, (samples.size() + room - 1) / room);
  Box box;
  for (std::size_t i = 0; i < samples.size(); i += every) {
    points_mm_.push_back(samples[i].position_mm);
    if (i == 0) box = {points_mm_[0], points_mm_[0]};
    box.min_mm = box.min_mm.cwiseMin(points_mm_.back());
    box.max_mm = box.max_mm.cwiseMax(points_mm_.back());
  }
  centre_mm_ = 0.5 * (box.min_mm + box.max_mm);
  for (const Vec3& p : points_mm_) radius_mm_ = std::max(radius_mm_, (p - centre_mm_).norm());
}

void PartnerContact::reset() noexcept {
  placed_ = false;
  force_n_.setZero();
  torque_nmm_.setZero();
}

PartnerContact::Known* PartnerContact::known(const PartnerTool& partner) noexcept {
  for (Known& k : known_)
    if (k.author == partner.author) return &k;
  for (Known& k : known_)
    if (k.author == 0) {
      k = {partner.author, partner.pose_bone_tool, 0.0, false};
      return &k;
    }
  return nullptr;
}

Pose PartnerContact::felt(const PartnerTool& partner) const noexcept {
  for (const Known& k : known_)
    if (k.author == partner.author) return k.pose_bone_tool;
  return partner.pose_bone_tool;
}

// Position and direction of the contact: the mean over all points inside, weighted by their depth. So neither jumps
// from point to point.
PartnerContact::Touch PartnerContact::touch(const TouchPoints& own, const Pose& pose_bone_own,
                                            const SolidLattice& solid, const Pose& pose_bone_partner) noexcept {
  Touch touch;
  const Pose pose_partner_own = pose_bone_partner.inverse() * pose_bone_own;
  if (!solid.near(pose_partner_own.point(own.centre_mm()), own.radius_mm())) return touch;
  const Eigen::Matrix3d turn = pose_partner_own.rotation.toRotationMatrix();
  double whole_mm = 0.0;
  Vec3 outward = Vec3::Zero();
  for (const Vec3& p : own.points_mm()) {
    double distance_mm = 0.0;
    Vec3 gradient;
    if (!solid.sample(turn * p + pose_partner_own.position_mm, distance_mm, gradient) || distance_mm >= 0.0) continue;
    touch.depth_mm = std::max(touch.depth_mm, -distance_mm);
    touch.at_mm -= distance_mm * p;
    outward -= distance_mm * gradient;
    whole_mm -= distance_mm;
  }
  // Right through the middle there is no way out: no force is better than a force that flickers.
  constexpr double kLeast = 0.05;
  if (whole_mm <= 0.0 || outward.norm() < kLeast * whole_mm) return {};
  touch.at_mm /= whole_mm;
  touch.outward = pose_bone_partner.direction(outward.normalized());
  return touch;
}

PartnerForce PartnerContact::step(const TouchPoints& own, const Pose& pose_bone_own,
                                  std::span<const PartnerTool> partners, double dt_s) noexcept {
  const Pose before = placed_ ? pose_bone_own_ : pose_bone_own;
  // The work of the last step's force since then.
  const Eigen::Quaterniond turned = pose_bone_own.rotation * before.rotation.conjugate();
  const Vec3 turn_rad = (turned.w() < 0.0 ? -2.0 : 2.0) * turned.vec();  // of a tick: small
  const double given_mj = force_n_.dot(pose_bone_own.position_mm - before.position_mm) + torque_nmm_.dot(turn_rad);
  (given_mj > 0.0 ? released_mj_ : put_in_mj_) += std::abs(given_mj);

  for (Known& k : known_) k.seen = false;
  PartnerForce result;
  Vec3 wanted_n = Vec3::Zero(), wanted_nmm = Vec3::Zero();
  for (const PartnerTool& partner : partners) {
    if (partner.author == 0 || !partner.solid || !(partner.lag_s <= params_.stale_s)) continue;
    Known* k = known(partner);
    if (!k) continue;
    k->seen = true;
    const double share = params_.low_pass_s > 0.0 ? -std::expm1(-dt_s / params_.low_pass_s) : 1.0;
    k->pose_bone_tool.position_mm += share * (partner.pose_bone_tool.position_mm - k->pose_bone_tool.position_mm);
    k->pose_bone_tool.rotation = k->pose_bone_tool.rotation.slerp(share, partner.pose_bone_tool.rotation).normalized();

    // A spring that stiffens while it is pressed makes energy. While tools touch, it only becomes softer.
    const Touch t = touch(own, pose_bone_own, *partner.solid, k->pose_bone_tool);
    const double stable_n_per_mm = std::min(
        params_.most_n_per_mm, params_.damping_n_s_per_mm / (std::max(0.0, partner.lag_s) + params_.low_pass_s + dt_s));
    k->n_per_mm = t.depth_mm > 0.0 && k->n_per_mm > 0.0 ? std::min(k->n_per_mm, stable_n_per_mm) : stable_n_per_mm;
    if (t.depth_mm <= 0.0) continue;

    const Vec3 arm_mm = pose_bone_own.direction(t.at_mm);
    const Vec3 moved_mm = pose_bone_own.point(t.at_mm) - before.point(t.at_mm);
    const double inwards_mm_per_s = -moved_mm.dot(t.outward) / dt_s;
    const double size_n = std::max(0.0, k->n_per_mm * t.depth_mm + params_.damping_n_s_per_mm * inwards_mm_per_s);
    wanted_n += size_n * t.outward;
    wanted_nmm += arm_mm.cross(size_n * t.outward);
    if (t.depth_mm > result.depth_mm) {
      result.depth_mm = t.depth_mm;
      result.n_per_mm = k->n_per_mm;
      result.author = partner.author;
    }
  }
  for (Known& k : known_)
    if (!k.seen) k = {};

  // Force and torque belong to one contact: a limit of one limits the other.
  const double size_n = wanted_n.norm();
  const double most_n = std::min(params_.most_n, force_n_.norm() + params_.most_n_per_s * dt_s);
  const double part = size_n > most_n ? most_n / size_n : 1.0;
  force_n_ = result.force_n = part * wanted_n;
  torque_nmm_ = result.torque_nmm = part * wanted_nmm;
  pose_bone_own_ = pose_bone_own;
  placed_ = true;
  return result;
}

}  // namespace osteon::haptic
