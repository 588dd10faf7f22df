// Baseline of contact: the bone round the tool in dense arrays, trilinear between samples, all points of the tool in
// one loop that the compiler vectorises. Evaluates what osteon::haptic::evaluate_contact() does. Plain floats: see
// swept_shape.hpp. Lengths in mm.
#pragma once
#include <array>
#include <vector>

namespace osteon::baselines {

// Samples of a box, z fastest. Sample (0, 0, 0) lies at `origin_mm`.
struct DenseGrid {
  std::array<int, 3> dims{};
  std::array<float, 3> origin_mm{};
  float pitch_mm = 1;
  std::vector<float> values;
};

// One entry for each point of the tool, tool frame.
struct PointArrays {
  std::vector<float> x, y, z, nx, ny, nz, area_mm2, arm_mm, edge;
};

// As osteon::haptic::ContactQuery.
struct ContactTask {
  std::array<float, 9> rotation{};             // from the tool's frame to the bone's, row by row
  std::array<float, 3> position_mm{};          // of the tip, bone frame
  std::array<float, 3> direction{}, toward{};  // the same direction in the bone's frame and in the tool's
  float lift_mm = 0, ahead_mm = 0, most_mm = 0, least_facing = 0;
  const float* strength = nullptr;  // a function of density in `strength_steps` steps up to `most_density`
  int strength_steps = 1;
  float most_density_g_cm3 = 1;
  float left_out_mm = 1e6f;  // distance of points that face away
};

struct PointValues {
  std::vector<float> distance_mm, gx, gy, gz, density_g_cm3;
};

// As osteon::haptic::ContactSums.
struct ContactTotals {
  float area = 0, engaged = 0, density = 0, milling = 0, arm = 0, turned = 0, edge = 0, nearest = 0;
  std::array<float, 3> force{}, torque{};
};

// Every point must be in the cells of both grids. `values` must have room for all points.
[[nodiscard]] ContactTotals dense_contact(const DenseGrid& solid, const DenseGrid& density, const PointArrays& points,
                                          const ContactTask& task, PointValues& values);

}  // namespace osteon::baselines
