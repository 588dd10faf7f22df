// The profile of Hounsfield units across cortex that is thinner than a scan resolves.
#pragma once
#include <optional>
#include <span>

namespace osteon::imaging {

// Along a line into a bone, HU are those of the surroundings, of the cortex, and of what is inside it. The scan blurs
// them with a Gaussian (Treece 2010):
//   HU(s) = outside + (cortex − outside) Φ((s − outer) / σ)
//           + (inside − cortex) Φ((s − outer − thickness) / σ).
struct CortexProfile {
  double outside_hu = 0.0, cortex_hu = 0.0, inside_hu = 0.0;
  double outer_mm = 0.0;  // where the cortex begins, along the line
  double thickness_mm = 0.0;
  double sigma_mm = 1.0;  // of the scan's point spread along the line

  [[nodiscard]] double blurred_hu(double at_mm) const;
};

// HU at equal steps along a line.
struct LineOfHu {
  double first_mm = 0.0, step_mm = 1.0;
  std::span<const double> hu;
};

struct CortexFit {
  CortexProfile profile;
  double rest_hu = 0.0;  // root of the mean square that the profile leaves
};

// Fits the HU of the surroundings and of the inside, where the cortex begins and its thickness. `cortex_hu`: of compact
// cortex, which must be known: of cortex thinner than about two sigma a scan shows only the product of thickness and
// HU. Nothing: the fit ends at a limit, so there is no such cortex on the line.
[[nodiscard]] std::optional<CortexFit> fit_cortex(const LineOfHu& line, double sigma_mm, double cortex_hu);

// The same with the cortex's HU unknown. Only for cortex of several sigma.
[[nodiscard]] std::optional<CortexFit> fit_thick_cortex(const LineOfHu& line, double sigma_mm, double cortex_guess_hu);

// One edge between two plateaus: HU(s) = low + (high − low) Φ((s − at) / σ).
struct EdgeFit {
  double low_hu = 0.0, high_hu = 0.0, at_mm = 0.0, sigma_mm = 0.0;
  double rest_hu = 0.0;
};
[[nodiscard]] std::optional<EdgeFit> fit_edge(const LineOfHu& line, double sigma_guess_mm);

}  // namespace osteon::imaging
