// What an image intensifier shows of the rays that got through: photons with their noise, glare, and grey values. Each
// is a step of its own.
//
// check() refuses settings from outside that the steps cannot work with. The steps themselves rely on it.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/radiology/c_arm.hpp"

namespace osteon::radiology {

// [A] One pulse of a mobile C-arm in its usual setting. Air kerma is the dose of the beam to air, without a patient.
struct Exposure {
  double air_kerma_at_metre_ugy = 2.0;
};
// Error: invalid_input, naming the field, as of the two below.
[[nodiscard]] Result<void> check(const Exposure& exposure);

// Nominal dose-area product of one pulse, Gy cm²: air kerma times area of the beam. It is the same at every distance
// from the source. Nominal, because it follows from the setting alone.
[[nodiscard]] double dose_area_gy_cm2(const ConeBeam& beam, const Exposure& exposure);

// [A] All three.
struct Intensifier {
  double detected = 0.65;       // part of the photons that counts: the detective quantum efficiency
  double glare = 0.1;           // part of the light that spreads over the whole image
  double glare_radius_mm = 40;  // on the detector: half the side of the square over which it spreads
};
[[nodiscard]] Result<void> check(const Intensifier& intensifier);

// What weakens the rays, ∫ μ dl of each pixel: the radiograph's layer, and that of cast_metal(), or none.
struct Layers {
  std::span<const float> bone, metal = {};
};
// Sets the pixels of a box to the mean number of photons that each counts: the kerma without a patient at the pixel, by
// the inverse square of the distance and the cosine of incidence, times exp(−∫ μ dl).
void count_photons(const ConeBeam& beam, const Layers& layers, const Exposure& exposure, const Intensifier& intensifier,
                   const PixelBox& box, std::span<float> photons);
// [A] Automatic brightness control: the pulse is as strong as the body in the middle of the image needs. A real C-arm
// raises the tube's voltage too, so the rays become harder. Here the energy stays, and only the kerma follows. So dose
// rises faster with thickness than that of a C-arm.
struct ExposureControl {
  double photons_per_mm2 = 600.0;  // that count, as a mean over the middle half of columns and rows of the detector
  double least_kerma_ugy = 0.1, most_kerma_ugy = 20.0;  // at 1 m: what the tube can do
};
[[nodiscard]] Result<void> check(const ExposureControl& control);
[[nodiscard]] Exposure controlled_exposure(const ConeBeam& beam, const Layers& layers, const Intensifier& intensifier,
                                           const ExposureControl& control);
// Replaces the means in a box by numbers of photons at random (Poisson). The noise of a pixel follows from the seed,
// its mean and its place in the image alone. So after a change, the boxes that count_photons() set again get the noise
// that the whole image would have. Its logarithm and cosine are those of the C library, so another library may give
// other numbers.
void add_quantum_noise(const PixelGrid& detector, const PixelBox& box, std::uint64_t seed, std::span<float> photons);
// Spreads a part of the light: veiling glare. The sum of all pixels stays, but for what leaves the image.
// Light spreads far, so this step takes the whole image, on a copy of the photons, as those after it do.
void add_glare(const PixelGrid& detector, const Intensifier& intensifier, std::span<float> photons);

// Photons that become black and white. Between them, grey follows the logarithm, so that equal thicknesses differ
// equally.
struct Contrast {
  float black = 1.0f, white = 1000.0f;
  bool inverted = false;  // dense matter is white, as on film
};
// White must be a hundredth above black, at least.
[[nodiscard]] Result<void> check(const Contrast& contrast);
// An automatic window: the darkest and the brightest hundredth of the image are black and white. It changes what is
// shown and no dose; controlled_exposure() does that.
[[nodiscard]] Contrast automatic_window(std::span<const float> photons);
[[nodiscard]] std::vector<std::uint8_t> grey_of(std::span<const float> photons, const Contrast& contrast);

}  // namespace osteon::radiology
