#include "tests/unit/audio_client/ideal_head.hpp"

#include <cmath>
#include <utility>

#include "audio_client/space/listener.hpp"
#include "tests/unit/audio_client/scripted_drilling.hpp"

namespace osteon::test {
namespace {

// An impulse between samples, without what is above kImpulse_hz: a sinc of 160 samples under a Hann window.
std::vector<float> impulse(double at, double level) {
  constexpr double kHalf = 80, kShare = 2 * kImpulse_hz / kRate_hz;
  std::vector<float> samples(256);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double x = static_cast<double>(i) - at;
    if (std::abs(x) >= kHalf) continue;
    const double sinc = std::abs(x) < 1e-9 ? kShare : std::sin(kPi * kShare * x) / (kPi * x);
    samples[i] = static_cast<float>(level * sinc * (0.5 + 0.5 * std::cos(kPi * x / kHalf)));
  }
  return samples;
}

}  // namespace

double woodworth_delay_s(double along) {
  const double radius_s = kHeadRadius_mm / audio::kSoundSpeed_mm_per_s;
  return along >= 0 ? -radius_s * along : radius_s * (std::acos(along) - 0.5 * kPi);
}

std::vector<audio::HeadResponse> sphere(const EarLevel& level) {
  constexpr double kBefore_s = 0.002;
  std::vector<audio::HeadResponse> measured;
  for (int up = -90; up <= 90; up += 10) {
    for (int round = 0; round < 360; round += 10) {
      const double e = up * kPi / 180, a = round * kPi / 180;
      audio::HeadResponse one;
      one.towards = 1400 * Vec3(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
      const double left = std::cos(e) * std::sin(a);
      one.left = impulse((kBefore_s + woodworth_delay_s(left)) * kRate_hz, level(left));
      one.right = impulse((kBefore_s + woodworth_delay_s(-left)) * kRate_hz, level(-left));
      measured.push_back(std::move(one));
      if (std::abs(up) == 90) break;
    }
  }
  return measured;
}

}  // namespace osteon::test
