// Collision of a tool's points with bone, by the cells of a segmentation (Niu 2008, §7.2) and by the distance field.
// Measures the distance between each method's surface and a ball's, in pitches, and the cost of a point. Prints JSON.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "common/volume/cell_collision.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/scenes/random.hpp"

namespace osteon::test {
namespace {

constexpr double kPitch_mm = 0.5, kRadius_mm = 15.0;
constexpr int kRays = 4000, kPoints = 200'000, kRounds = 15;
const Vec3 kCentre{0.13, -0.21, 0.07};

void print(const char* name, std::vector<double> values) {
  std::ranges::sort(values);
  std::printf("\"%s_p50\": %.4f, \"%s_min\": %.4f, \"%s_max\": %.4f, ", name, values[values.size() / 2], name,
              values.front(), name, values.back());
}

// Along rays from outside to the first contact: mean (outwards positive), rms and largest distance from the ball.
template <class Inside>
void accuracy(const char* name, double pitch, Inside inside) {
  Random random(1);
  double mean = 0.0, square = 0.0, largest = 0.0;
  for (int i = 0; i < kRays; ++i) {
    const Vec3 direction = random.direction();
    double r = kRadius_mm + 2.0 * pitch;
    while (!inside(Vec3(kCentre + r * direction)) && r > kRadius_mm - 2.0 * pitch) r -= 0.002 * pitch;
    const double error = (r - kRadius_mm) / pitch;
    mean += error / kRays;
    square += error * error / kRays;
    largest = std::max(largest, std::abs(error));
  }
  std::printf("\"%s_mean_pitches\": %.4f, \"%s_rms_pitches\": %.4f, \"%s_largest_pitches\": %.4f, ", name, mean, name,
              std::sqrt(square), name, largest);
}

// Points within two pitches of the surface, where a tool's points are.
template <class Inside>
void cost(const char* name, const std::vector<Vec3>& points, Inside inside) {
  std::vector<double> ns;
  int hits = 0;
  for (int round = 0; round < kRounds; ++round) {
    const auto start = std::chrono::steady_clock::now();
    for (const Vec3& p : points) hits += inside(p) ? 1 : 0;
    ns.push_back(1e9 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() /
                 static_cast<double>(points.size()));
  }
  print((std::string(name) + "_ns").c_str(), ns);
  std::printf("\"%s_hits\": %.4f, ", name, static_cast<double>(hits) / (kRounds * static_cast<double>(points.size())));
}

int run() {
  const CutField field(
      make_bone(
          {Vec3::Constant(-16.0), Vec3::Constant(16.0)}, kPitch_mm,
          [](const Vec3& p) { return (p - kCentre).norm() - kRadius_mm; }, [](const Vec3&) { return 1.9; }),
      {});
  const CoordBox box{{-36, -36, -36}, {36, 36, 36}};
  const BoneCells cells(field, 0, box);
  const BoneDistance distance(field, 0, box);
  const auto nearest = [&](const Vec3& p) { return cells.inside(p, MixedCell::nearest); };
  const auto trilinear = [&](const Vec3& p) { return cells.inside(p, MixedCell::trilinear); };
  const auto patch = [&](const Vec3& p) { return distance.inside(p); };
  const auto grid = [&](const Vec3& p) { return field.solid_mm(p) <= 0.0; };
  Random random(2);
  std::vector<Vec3> points;
  for (int i = 0; i < kPoints; ++i)
    points.push_back(kCentre + (kRadius_mm + random.between(-2.0, 2.0) * kPitch_mm) * random.direction());
  std::printf("{\"pitch_mm\": %g, \"points\": %d, ", kPitch_mm, kPoints);
  accuracy("nearest", kPitch_mm, nearest);
  accuracy("trilinear", kPitch_mm, trilinear);
  accuracy("distance", kPitch_mm, patch);
  cost("nearest", points, nearest);
  cost("trilinear", points, trilinear);
  cost("distance", points, patch);
  cost("field", points, grid);
  std::printf("\"cells_bytes\": %zu, \"distance_bytes\": %zu}\n", cells.memory_bytes(), distance.memory_bytes());
  return 0;
}

}  // namespace
}  // namespace osteon::test

int main() { return osteon::test::run(); }
