// How well an imported bone agrees with the bone that was scanned: phantoms of known shape through DICOM files with
// noise, blur, thick, tilted and uneven slices. Takes a folder for the slices. Prints JSON: for each scan, with the
// default options, with --thin-cortex on, with the suggested threshold, and with the one midway between soft tissue and
// cortex, Dice, distances of the surfaces, number of islands, and errors of density and mass as test::accuracy_of()
// says. The case was saved and loaded again.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/support/scenes/scanned_bones.hpp"

namespace {

constexpr double kSkin_mm = 24.0;  // radius of the limb

}  // namespace

int main(int argc, char** argv) {
  using namespace osteon;
  if (argc != 2) {
    std::fputs("usage: osteon-import-accuracy FOLDER\n", stderr);
    return EXIT_FAILURE;
  }
  nlohmann::json found = nlohmann::json::array();
  for (test::BoneScan scan : test::accuracy_scans())
    for (const std::string how : {"default", "thin cortex", "suggested", "midway"}) {
      const std::filesystem::path folder = std::filesystem::path(argv[1]) / "scan";
      import::CtOptions options;
      options.thin_cortex = how == "thin cortex";
      // The blur is measured at the skin.
      scan.skin_mm = options.thin_cortex ? std::optional(kSkin_mm) : std::nullopt;
      options.suggest_threshold = how == "suggested";
      if (how == "midway") options.threshold_hu = test::kMidway_hu;
      const auto measured = test::measure_accuracy(scan, options, folder);
      std::filesystem::remove_all(folder);
      if (!measured) {
        std::fprintf(stderr, "osteon-import-accuracy: %s: %s\n", scan.name.c_str(), measured.error().message.c_str());
        return EXIT_FAILURE;
      }
      found.push_back({{"scan", scan.name},
                       {"options", how},
                       {"dice", measured->dice},
                       {"mean_mm", measured->mean_mm},
                       {"percentile95_mm", measured->percentile95_mm},
                       {"offset_mm", measured->offset_mm},
                       {"islands", measured->islands},
                       {"cortical_percent", measured->cortical_percent},
                       {"cancellous_percent", measured->cancellous_percent},
                       {"mass_percent", measured->mass_percent},
                       {"cortical_mass_percent", measured->cortical_mass_percent},
                       {"cancellous_mass_percent", measured->cancellous_mass_percent}});
    }
  std::printf("%s\n", found.dump(1).c_str());
  return EXIT_SUCCESS;
}
