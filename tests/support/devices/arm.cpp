#include "tests/support/devices/arm.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <new>

namespace osteon::test {
namespace {

void* map(const char* file, bool make) noexcept {
  const int descriptor = ::open(file, O_RDWR | O_CLOEXEC | (make ? O_CREAT | O_TRUNC : 0), 0600);
  if (descriptor < 0) return nullptr;
  void* place = nullptr;
  if (!make || ::ftruncate(descriptor, sizeof(ArmControl)) == 0)
    place = ::mmap(nullptr, sizeof(ArmControl), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
  ::close(descriptor);
  return place == MAP_FAILED ? nullptr : place;
}

}  // namespace

ArmStrings::ArmStrings(const std::filesystem::path& file) {
  void* place = map(file.c_str(), true);
  if (!place) std::abort();
  control_ = static_cast<ArmControl*>(place);
  reset();
  ::setenv(kArmVariable, file.c_str(), 1);
}

ArmStrings::~ArmStrings() {
  ::unsetenv(kArmVariable);
  ::munmap(control_, sizeof(ArmControl));
}

void ArmStrings::reset() const noexcept {
  new (control_) ArmControl;
  control_->rotation[0] = 1.0;
}

void ArmStrings::hand(double x_mm, double y_mm, double z_mm) const noexcept {
  control_->hand_mm[0] = x_mm;
  control_->hand_mm[1] = y_mm;
  control_->hand_mm[2] = z_mm;
}

double ArmStrings::force_n() const noexcept {
  return std::hypot(control_->force_n[0], control_->force_n[1], control_->force_n[2]);
}

ArmControl* find_arm() noexcept {
  const char* file = std::getenv(kArmVariable);
  return file ? static_cast<ArmControl*>(map(file, false)) : nullptr;
}

void Arm::step(ArmControl& control, const std::array<double, 3>& force_n,
               const std::array<double, 3>& torque_nmm) noexcept {
  constexpr double kTime_s = 1e-3;
  const double size = std::hypot(force_n[0], force_n[1], force_n[2]);
  const double share = size > kPeak_n ? kPeak_n / size : 1.0;
  if (size > control.peak_n) control.peak_n = size;
  if (size > 0.0 && (control.calibration != 0 || !control.motors_on)) ++control.unsafe_forces;
  const double k = control.hand_n_per_mm;
  const double b = 2.0 * std::sqrt(1e3 * k * kMass_kg) * 1e-3;  // N s/mm, critical
  for (std::size_t i = 0; i < 3; ++i) {
    // A hand that its damper slows: semi-implicit integration, stable for every k here.
    const double f = force_n[i] * share + k * (control.hand_mm[i] - position_mm_[i]) - b * velocity_mm_per_s_[i];
    velocity_mm_per_s_[i] += 1e3 * f / kMass_kg * kTime_s;
    position_mm_[i] += velocity_mm_per_s_[i] * kTime_s;
    control.arm_mm[i] = position_mm_[i];
    control.force_n[i] = force_n[i];
    control.torque_nmm[i] = torque_nmm[i];
  }
  ++control.cycles;
}

}  // namespace osteon::test
