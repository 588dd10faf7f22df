// Window and level: which HU a picture shows from black to white.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

namespace osteon {

struct GreyWindow {
  double centre_hu = 400.0, width_hu = 1800.0;  // usual for bone
  friend bool operator==(const GreyWindow&, const GreyWindow&) = default;
};

inline constexpr GreyWindow kBoneWindow{400.0, 1800.0}, kSoftTissueWindow{40.0, 400.0}, kWideWindow{500.0, 4000.0};
inline constexpr double kLeastWidth_hu = 1.0, kMostWidth_hu = 8000.0;

// The grey value of each HU by the linear function of DICOM PS3.3, C.11.2.1.2.1.
class GreyTable {
 public:
  explicit GreyTable(const GreyWindow& window);
  [[nodiscard]] std::uint8_t operator[](std::int16_t hu) const { return greys_[static_cast<std::size_t>(hu + 32768)]; }

 private:
  std::vector<std::uint8_t> greys_;
};

// The window after a drag of so many pixels: to the right it gets wider, downwards its centre rises, so that the
// picture gets darker. Both are as fast as the window is wide.
[[nodiscard]] GreyWindow dragged(const GreyWindow& window, double right_px, double down_px);

}  // namespace osteon
