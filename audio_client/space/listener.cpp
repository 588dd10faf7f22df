#include "audio_client/space/listener.hpp"

#include <string>

#include "common/core/bounded_text.hpp"

namespace osteon::audio {
namespace {

constexpr double kLoudspeakers_mm = 200, kHeadphones_mm = 500;

// 8.4 puts the surgeon's ear 20 to 25 beside the hole and 35 to 45 above it. It prints mm, but only cm reach an ear.
const Vec3 kTowardsSurgeon = Vec3(-22.5, -40.0, 0.0).normalized();

// A unit vector at right angles to `axis`, as near to `wish` as that allows.
Vec3 across(const Vec3& axis, const Vec3& wish) {
  const Vec3 part = wish - wish.dot(axis) * axis;
  return part.norm() > 1e-6 ? Vec3(part.normalized()) : axis.unitOrthogonal();
}

}  // namespace

Result<Listening> listening(std::string_view name) {
  if (name == "mono") return Listening::mono;
  if (name == "loudspeakers") return Listening::loudspeakers;
  if (name == "headphones") return Listening::headphones;
  return failure(ErrorCode::invalid_input, "nobody listens by \"" + bounded_text(name, 40) +
                                               "\"; choose --listen loudspeakers, headphones or mono");
}

double reference_mm(Listening listening) noexcept {
  return listening == Listening::headphones ? kHeadphones_mm : kLoudspeakers_mm;
}

Vec3 usual_listener_mm(Listening listening) { return reference_mm(listening) * kTowardsSurgeon; }

Pose looking(const Vec3& from_mm, const Vec3& at_mm, const Vec3& up) {
  const Vec3 way = at_mm - from_mm;
  const Vec3 ahead = way.norm() > 1e-6 ? Vec3(way.normalized()) : Vec3(Vec3::UnitX());
  Eigen::Matrix3d axes;
  axes.col(0) = ahead;
  axes.col(2) = across(ahead, up);
  axes.col(1) = axes.col(2).cross(ahead);
  return {from_mm, Eigen::Quaterniond(axes).normalized()};
}

}  // namespace osteon::audio
