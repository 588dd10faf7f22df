// The background, the lights and the shadows of a picture. All functions: [render], the thread that opened the window.
#pragma once
#include <array>

class vtkRenderer;

namespace osteon {

inline constexpr std::array<double, 3> kBackground{0.115, 0.140, 0.170};  // red, green, blue: 0 to 1

// Sets the background and three lights that move with the camera. Prepares soft shadows in hollows, but does not
// switch them on.
void set_lighting(vtkRenderer& renderer);

}  // namespace osteon
