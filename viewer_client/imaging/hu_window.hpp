// From HU to grey: the window of a viewer of CT, by its level and width.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace osteon {

// DICOM's linear window (PS3.3 C.11.2.1.3.2): black and white at level ∓ width / 2, linear between them.
struct HuWindow {
  double level_hu = 500.0, width_hu = 2000.0;

  [[nodiscard]] std::uint8_t grey(double hu) const {
    const double part = (hu - level_hu) / width_hu + 0.5;
    return static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(part, 0.0, 1.0)));
  }
  friend bool operator==(const HuWindow&, const HuWindow&) = default;
};

// [A] Usual windows.
inline constexpr HuWindow kBoneWindow{500.0, 2000.0}, kSoftTissueWindow{40.0, 400.0}, kWideWindow{1000.0, 4000.0};
inline constexpr double kLeastLevel_hu = -1000.0, kMostLevel_hu = 4000.0, kLeastWidth_hu = 10.0, kMostWidth_hu = 8000.0;

// After a drag over the image, in pixels: to the right the window gets wider, down its level rises, so the image
// gets darker. [A] A pixel is a two hundredth of the width, and 5 HU at least, so that narrow windows are set finely.
[[nodiscard]] inline HuWindow dragged(const HuWindow& window, double right_px, double down_px) {
  const double hu_per_px = std::max(5.0, window.width_hu / 200.0);
  return {std::clamp(window.level_hu + hu_per_px * down_px, kLeastLevel_hu, kMostLevel_hu),
          std::clamp(window.width_hu + hu_per_px * right_px, kLeastWidth_hu, kMostWidth_hu)};
}

// The grey value of each HU that 16 bits hold.
class GreyTable {
 public:
  explicit GreyTable(const HuWindow& window);
  [[nodiscard]] std::uint8_t operator[](std::int16_t hu) const { return greys_[static_cast<std::size_t>(hu + 32768)]; }

 private:
  std::vector<std::uint8_t> greys_;
};

// `grey` has one value for each of `hu`. The window's width is above zero.
void grey_of(std::span<const float> hu, const HuWindow& window, std::span<std::uint8_t> grey);

}  // namespace osteon
