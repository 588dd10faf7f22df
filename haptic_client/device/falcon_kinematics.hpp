// Novint Falcon: converts encoder counts to the grip's position and back, and computes the torques that show a force
// there. The device has three equal legs. Each leg is an arm that the motor turns and a parallelogram that carries the
// grip. So the grip moves without rotation. The geometry is that of Stamper 1997. Lengths and counts are those of
// public drivers of the device. Metres and radians, in the device's own frame: z out of its face to the user, x right,
// y up.
#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include <Eigen/Core>

namespace osteon::haptic {

using FalconCounts = std::array<std::int16_t, 3>;

// The middle of the space that the grip reaches; poses are relative to it.
inline constexpr double kFalconOriginZ_m = 0.150;
inline constexpr int kFalconMaxMotor = 4096;

// Angle of a leg's arm from its encoder counts and back; the counts are not rounded.
[[nodiscard]] double falcon_angle_rad(double counts) noexcept;
[[nodiscard]] double falcon_counts(double angle_rad) noexcept;

// [haptic] The arms' angles that hold the grip at a position; empty where a leg does not reach it.
[[nodiscard]] std::optional<Eigen::Vector3d> falcon_angles(const Eigen::Vector3d& grip_m) noexcept;

// [haptic] The grip's position for the arms' angles, by Newton's method from `near_m`. That may be any position in the
// workspace, such as the last one. Empty for angles that no position has.
[[nodiscard]] std::optional<Eigen::Vector3d> falcon_place(const Eigen::Vector3d& angles_rad,
                                                          const Eigen::Vector3d& near_m) noexcept;

// [haptic] J = dθ/dp, rad/m, by differentiating each leg's closure. Empty where a leg is stretched out and its arm no
// longer follows the grip.
[[nodiscard]] std::optional<Eigen::Matrix3d> falcon_jacobian(const Eigen::Vector3d& angles_rad,
                                                             const Eigen::Vector3d& grip_m) noexcept;

// [haptic] τ = J⁻ᵀ F, N m: virtual work τ·dθ = F·dp with dθ = J dp. Zero where J cannot be inverted.
[[nodiscard]] Eigen::Vector3d falcon_torques(const Eigen::Vector3d& angles_rad, const Eigen::Vector3d& grip_m,
                                             const Eigen::Vector3d& force_n) noexcept;

// [haptic] Motor commands −10⁴ τ. Where one would exceed the motors' range, all three are scaled down equally. So
// the force keeps its direction.
[[nodiscard]] FalconCounts falcon_motors(const Eigen::Vector3d& torques_nm) noexcept;

}  // namespace osteon::haptic
