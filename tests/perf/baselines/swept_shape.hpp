// A cut's swept tool in plain floats, as the baselines read it: a capsule for a ball, or a turned body that moves along
// its axis. The parameters are those of Osteon's tool; the code shares nothing with Osteon's kernel. This header has no
// Eigen, because the files that include it may be compiled for the machine's own processor.
#pragma once
#include <array>

namespace osteon {
struct Cut;
}

namespace osteon::baselines {

struct SweptShape {
  // An edge of the outline in (distance from the axis, position along it), counter-clockwise, mm.
  struct Edge {
    float r, s, er, es, length;
  };
  static constexpr int kMostEdges = 12;

  bool ball = true;
  float pitch_mm = 0, band_mm = 0;        // of the cut's level
  std::array<float, 3> start{};           // ball: its centre; turned: the tip. Bone frame, mm.
  std::array<float, 3> motion{};          // ball
  float inverse_square = 0;               // ball: 1 / |motion|², 0 without motion
  float radius = 0;                       // ball: its radius; turned: the largest distance from the axis
  std::array<float, 3> axis{}, u{}, v{};  // turned: unit vectors, +z of the tool and two across it
  std::array<Edge, kMostEdges> edges{};
  int edge_count = 0;
  std::array<float, 3> low{}, high{};  // box of the swept body, grown by the band, mm
};

// `pitch_mm`: h of the case. Aborts unless the tool is a ball, or is turned and moves along its axis without turning.
[[nodiscard]] SweptShape swept_shape(const Cut& cut, double pitch_mm);

}  // namespace osteon::baselines
