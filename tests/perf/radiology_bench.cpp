// Radiographs and slices of a case, in turns with VTK's in one run, one thread each: a whole radiograph of 800 x 600,
// the part of it that a drill's cut of 8 ms changed, and three slices of 512 x 512. Takes the folder of a case, and the
// number of turns. Prints JSON.
#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "common/radiology/radiograph.hpp"
#include "common/radiology/slice.hpp"
#include "tests/perf/baselines/vtk_radiology.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/xvfb.hpp"

namespace osteon::test {
namespace {

constexpr double kAdvance_mm = 0.08;  // of a drill in 8 ms
constexpr int kBefore = 25;           // cuts before the first that is measured, so that the drill is in the bone

template <class Work>
double ms(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return 1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void print(const char* name, std::vector<double> values) {
  std::ranges::sort(values);
  std::printf(", \"%s\": {\"p50\": %.4f, \"min\": %.4f, \"max\": %.4f}", name, values[values.size() / 2],
              values.front(), values.back());
}

// Where a drill from the patient's front enters the bone, near the middle.
Vec3 entry_of(const Case& bone) {
  const Box bounds = bone.bounds();
  Vec3 best = bounds.centre_mm();
  for (double off = 0.0; off < 0.5; off += 0.02)
    for (double y = bounds.min_mm.y(); y < bounds.max_mm.y(); y += 0.25) {
      const Vec3 p(bounds.centre_mm().x() + off * bounds.size_mm().x(), y, bounds.centre_mm().z());
      if (bone.surface_mm(p) < -1.0) return p;
    }
  return best;
}

struct Times {
  std::vector<double> ours, vtk, changed, slices, vtk_slices;
};

// Mean difference of the parts of the photons that get through.
double difference(const radiology::Radiograph& ours, const std::vector<std::uint8_t>& vtk) {
  double sum = 0.0;
  for (std::size_t i = 0; i < vtk.size(); ++i)
    sum += std::abs(std::exp(-static_cast<double>(ours.attenuation()[i])) - vtk[i] / 255.0);
  return sum / static_cast<double>(vtk.size());
}

int measure(const Case& bone, const CaseScan* scan, int turns) {
  auto made = radiology::BoneHu::make(bone, scan);
  if (!made) {
    std::fprintf(stderr, "osteon-radiology-bench: %s\n", made.error().message.c_str());
    return 1;
  }
  const Vec3 entry = entry_of(bone), axis = Vec3::UnitY();
  const radiology::ConeBeam beam = *radiology::beam_of(radiology::c_arm_at(radiology::View::lateral, entry));
  radiology::Radiograph image(beam);
  baselines::VtkRadiograph vtk(*made, beam);
  baselines::VtkSlices vtk_slices(*made);
  const radiology::ToolPlanes planes = radiology::tool_planes(pose_along(entry, axis), {});
  const radiology::PixelGrid three[] = {planes.along, planes.turned, planes.across};
  std::vector<float> hu(three[0].count());
  CutField field(bone, {});
  const std::vector<const CutField*> bodies{&field};
  const auto drill = find_tool("drill-3.2");
  Times times;
  image.cast(*made);
  (void)vtk.cast_ms();
  const double apart = difference(image, vtk.picture());
  std::size_t pixels = 0;
  for (int turn = -kBefore; turn < turns; ++turn) {
    const CutReport report = field.apply(straight_cut(*drill, entry + kAdvance_mm * (turn + kBefore) * axis,
                                                      entry + kAdvance_mm * (turn + kBefore + 1) * axis, axis));
    const std::vector<ChangedLeaves> changes{{report.level, report.changed_leaves}};
    std::vector<radiology::PixelBox> boxes;
    const double changed = ms([&] { boxes = image.recast(*made, made->update(bodies, changes)); });
    if (turn < 0) continue;
    for (const radiology::PixelBox& b : boxes)
      pixels += to_index((b.last_column - b.first_column + 1) * (b.last_row - b.first_row + 1));
    times.changed.push_back(changed);
    times.ours.push_back(ms([&] { image.cast(*made); }));
    times.vtk.push_back(vtk.cast_ms());
    times.slices.push_back(ms([&] {
      for (const radiology::PixelGrid& plane : three) radiology::sample_slice(*made, plane, hu);
    }));
    times.vtk_slices.push_back(ms([&] {
      for (const radiology::PixelGrid& plane : three) (void)vtk_slices.slice(plane);
    }));
  }
  std::printf("{\"samples\": %zu, \"memory_mb\": %.1f, \"difference\": %.4f, \"changed_pixels\": %zu",
              made->memory_bytes() / 4, static_cast<double>(made->memory_bytes()) * 1e-6, apart,
              pixels / static_cast<std::size_t>(turns));
  print("radiograph_ms", times.ours);
  print("vtk_radiograph_ms", times.vtk);
  print("changed_ms", times.changed);
  print("slices_ms", times.slices);
  print("vtk_slices_ms", times.vtk_slices);
  std::printf("}\n");
  return 0;
}

int measure_case(const char* folder, int turns) {
  const auto bone = Case::load(folder);
  if (!bone) {
    std::fprintf(stderr, "osteon-radiology-bench: %s\n", bone.error().message.c_str());
    return 1;
  }
  // A screen that is wider than the image, because some window managers take a margin.
  const auto screen = Xvfb::start("1280x720");
  if (!screen) {
    std::fprintf(stderr, "osteon-radiology-bench: Xvfb, of Debian's package xvfb, did not start\n");
    return 1;
  }
  ::setenv("DISPLAY", screen->display().c_str(), 1);
  ::setenv("LIBGL_ALWAYS_SOFTWARE", "1", 1);
  if (!bone->info().scan) return measure(*bone, nullptr, turns);
  const auto scan = load_scan(folder, *bone);
  if (!scan) {
    std::fprintf(stderr, "osteon-radiology-bench: %s\n", scan.error().message.c_str());
    return 1;
  }
  return measure(*bone, &*scan, turns);
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) {
  const int turns = argc > 2 ? std::atoi(argv[2]) : 0;
  if (turns < 1) {
    std::fprintf(stderr, "osteon-radiology-bench: needs the folder of a case and the number of turns\n");
    return 1;
  }
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  return osteon::test::measure_case(argv[1], turns);
}
