// How well phantom bones come back from a simulated CT, and how near a phantom comes to a real femur. Takes a folder
// for the slices and, if there is one, the STL file of a femur. Prints JSON: Dice and errors of density, see
// test::agreement_of_scan() and test::dice_of_bones(); the difference of thrusts, see drill_phantom_and_scan(); and for
// the real femur the mean distance, the larger one of both ways, and the largest error of areas and second moments of
// its sections from 20 to 75 % of the length.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "common/geometry/mesh_file.hpp"
#include "common/phantoms/joint.hpp"
#include "tests/support/scenes/fitted_femur.hpp"
#include "tests/support/scenes/scanned_phantoms.hpp"
#include "tests/unit/haptic_client/drilled_phantom.hpp"

namespace osteon::test {
namespace {

namespace fs = std::filesystem;

template <class T>
T value_of(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(*result);
}

nlohmann::json whole(const phantoms::BoneRecipe& recipe, const import::CtOptions& options, const fs::path& folder) {
  const PhantomAgreement found =
      value_of(agreement_of_scan(*value_of(phantoms::make_bone(recipe)), options, folder / recipe.kind));
  return {{"dice", found.dice},
          {"cortical_percent", found.cortical_percent},
          {"cancellous_percent", found.cancellous_percent}};
}

nlohmann::json apart(const char* kind, const char* landmark, int bone, const fs::path& folder) {
  const auto joint = value_of(phantoms::make_bone({.kind = kind}));
  std::vector<BoneSeed> more;
  if (landmark != nullptr) more.push_back({phantoms::point_of(*joint, landmark), bone});
  nlohmann::json found;
  for (const auto& [name, dice] : value_of(dice_of_bones(*joint, more, folder / kind))) found[name] = dice;
  return found;
}

nlohmann::json fit(const fs::path& file) {
  const TriangleMesh mesh = value_of(read_stl(file));
  const FittedFemur femur = fit_femur(spread_points(mesh, 3000));
  const double to_phantom = distances_mm(femur, spread_points(mesh, 20000)).cwiseAbs().mean();
  const std::vector<Vec3> points = points_on(femur.bone, 1000);
  double to_mesh = 0.0;
  for (const Vec3& p : points)
    to_mesh += distance_to_mesh_mm(mesh, femur.pose_mesh_bone.point(p)) / static_cast<double>(points.size());
  double most = 0.0;
  for (int percent = 20; percent <= 75; percent += 5) {
    const ShaftPlane plane = shaft_plane(femur.parameters, 0.01 * percent);
    const SectionMoments real = section_of(mesh, femur.pose_mesh_bone.inverse(), plane);
    const SectionMoments ours = section_of(femur.bone, plane);
    for (const double ratio : {ours.area / real.area, ours.xx / real.xx, ours.yy / real.yy})
      most = std::max(most, std::abs(ratio - 1.0));
  }
  return {{"distance_mm", std::max(to_phantom, to_mesh)}, {"sections_percent", 100.0 * most}};
}

nlohmann::json measured(const fs::path& folder, const char* mesh) {
  import::CtOptions both;
  both.keep = {1, 2};
  nlohmann::json found;
  found["femur"] = whole({}, {}, folder);
  found["tibia"] = whole({.kind = "tibia", .side = phantoms::Side::right}, both, folder);
  found["knee"] = apart("knee", nullptr, 0, folder);
  // The head needs a seed of its own, see PhantomJointsCt.AHipComesBackAsTwoBones.
  found["hip"] = apart("hip", "head centre", 2, folder);
  found["force_percent"] = value_of(haptic::test::drill_phantom_and_scan(folder / "drilled")).difference_percent;
  if (mesh != nullptr) found["fit"] = fit(mesh);
  return found;
}

}  // namespace
}  // namespace osteon::test

int main(int argc, char** argv) {
  if (argc != 2 && argc != 3) {
    std::fputs("usage: osteon-phantom-accuracy FOLDER [FEMUR.stl]\n", stderr);
    return EXIT_FAILURE;
  }
  try {
    std::printf("%s\n", osteon::test::measured(argv[1], argc == 3 ? argv[2] : nullptr).dump(1).c_str());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "osteon-phantom-accuracy: %s\n", error.what());
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
