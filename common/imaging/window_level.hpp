// Hounsfield units as grey values for the eye.
#pragma once
#include <cstdint>

namespace osteon::imaging {

// The HU that become grey. Width: at least 1 HU.
struct Window {
  double centre_hu = 400.0, width_hu = 1800.0;  // usual for bone
};

// 0 (black) to 255 (white) by the linear function of DICOM PS3.3, C.11.2.1.2.1, rounded to the nearest.
[[nodiscard]] std::uint8_t grey_of(double hu, const Window& window);

}  // namespace osteon::imaging
