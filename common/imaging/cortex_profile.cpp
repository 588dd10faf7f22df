#include "common/imaging/cortex_profile.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace osteon::imaging {
namespace {

// Φ and its derivative from a table, because a bone has a million fits. The error is below 1e-6.
class Normal {
 public:
  static constexpr double kEnd = 6.0;
  static constexpr int kCells = 4096;

  Normal() {
    for (int i = 0; i <= kCells; ++i) {
      const double z = kEnd * (2.0 * i / kCells - 1.0);
      cumulative_[static_cast<std::size_t>(i)] = 0.5 * std::erfc(-z / std::numbers::sqrt2);
      density_[static_cast<std::size_t>(i)] = std::exp(-0.5 * z * z) / std::sqrt(2.0 * std::numbers::pi);
    }
  }
  struct Value {
    double cumulative, density;
  };
  [[nodiscard]] Value at(double z) const {
    const double cell = (z / kEnd + 1.0) * (0.5 * kCells);
    if (!(cell > 0.0)) return {0.0, 0.0};
    if (cell >= kCells) return {1.0, 0.0};
    const auto low = static_cast<std::size_t>(cell);
    const double part = cell - static_cast<double>(low);
    return {cumulative_[low] + part * (cumulative_[low + 1] - cumulative_[low]),
            density_[low] + part * (density_[low + 1] - density_[low])};
  }

 private:
  std::array<double, kCells + 1> cumulative_{}, density_{};
};

const Normal& normal() {
  static const Normal made;
  return made;
}

// Levenberg–Marquardt for a model with N unknowns. `model`: value and derivatives at a position; `limit` keeps the
// unknowns within their limits.
template <int N, class Model, class Limit>
double fit_line(const LineOfHu& line, Eigen::Matrix<double, N, 1>& unknowns, const Model& model, const Limit& limit) {
  using Vector = Eigen::Matrix<double, N, 1>;
  using Matrix = Eigen::Matrix<double, N, N>;
  constexpr int kIterations = 25;
  constexpr double kEnough = 1e-5;
  const auto squares = [&](const Vector& at, Matrix* hessian, Vector* gradient) {
    if (hessian != nullptr) hessian->setZero();
    if (gradient != nullptr) gradient->setZero();
    double sum = 0.0;
    for (std::size_t i = 0; i < line.hu.size(); ++i) {
      Vector slope;
      const double rest = line.hu[i] - model(at, line.first_mm + line.step_mm * static_cast<double>(i), slope);
      sum += rest * rest;
      if (hessian == nullptr) continue;
      *hessian += slope * slope.transpose();
      *gradient += rest * slope;
    }
    return sum;
  };
  double damping = 1e-2;
  Matrix hessian;
  Vector gradient;
  double least = squares(unknowns, &hessian, &gradient);
  for (int i = 0; i < kIterations && damping < 1e6; ++i) {
    Matrix damped = hessian;
    damped.diagonal() += damping * hessian.diagonal() + Vector::Constant(1e-9);
    Vector next = unknowns + damped.ldlt().solve(gradient);
    limit(next);
    const double here = squares(next, nullptr, nullptr);
    if (!(here < least)) {
      damping *= 10.0;
      continue;
    }
    const bool enough = here > (1.0 - kEnough) * least;
    unknowns = next;
    least = squares(unknowns, &hessian, &gradient);
    damping = std::max(1e-7, 0.2 * damping);
    if (enough) break;
  }
  return std::sqrt(least / static_cast<double>(line.hu.size()));
}

double mean_of(std::span<const double> values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

// Where HU first reach a value.
double first_at(const LineOfHu& line, double hu) {
  for (std::size_t i = 1; i < line.hu.size(); ++i) {
    if (line.hu[i] < hu) continue;
    const double rise = line.hu[i] - line.hu[i - 1];
    const double part = rise > 0.0 ? std::clamp((hu - line.hu[i - 1]) / rise, 0.0, 1.0) : 0.0;
    return line.first_mm + line.step_mm * (static_cast<double>(i) - 1.0 + part);
  }
  return line.first_mm;
}

constexpr double kLeastThickness = 0.05, kThinnest = 0.15;  // sigmas: in a fit, and of what counts as cortex
constexpr std::size_t kEnd = 4;                             // values that are the surroundings or the inside, at first

// Unknowns: outside, inside, outer, thickness, and the cortex if `thick`.
template <bool thick>
std::optional<CortexFit> fit_profile(const LineOfHu& line, double sigma_mm, double cortex_hu) {
  constexpr int kUnknowns = thick ? 5 : 4;
  using Vector = Eigen::Matrix<double, kUnknowns, 1>;
  if (line.hu.size() < 2 * kEnd) return {};
  const double last_mm = line.first_mm + line.step_mm * static_cast<double>(line.hu.size() - 1);
  const double least_mm = kLeastThickness * sigma_mm, most_mm = last_mm - line.first_mm;
  const auto model = [&](const Vector& u, double at_mm, Vector& slope) {
    const double cortex = thick ? u[kUnknowns - 1] : cortex_hu;
    const Normal::Value outer = normal().at((at_mm - u[2]) / sigma_mm),
                        inner = normal().at((at_mm - u[2] - u[3]) / sigma_mm);
    slope[0] = 1.0 - outer.cumulative;
    slope[1] = inner.cumulative;
    slope[3] = -(u[1] - cortex) * inner.density / sigma_mm;
    slope[2] = -(cortex - u[0]) * outer.density / sigma_mm + slope[3];
    if (thick) slope[kUnknowns - 1] = outer.cumulative - inner.cumulative;
    return u[0] + (cortex - u[0]) * outer.cumulative + (u[1] - cortex) * inner.cumulative;
  };
  const auto limit = [&](Vector& u) {
    u[2] = std::clamp(u[2], line.first_mm, last_mm);
    u[3] = std::clamp(u[3], least_mm, most_mm);
  };
  const double outside = mean_of(line.hu.first(kEnd)), inside = mean_of(line.hu.last(kEnd));
  const double peak = *std::ranges::max_element(line.hu);
  std::optional<CortexFit> best;
  for (const double start : {0.6, 1.8, 4.0}) {
    Vector u;
    u[0] = outside;
    u[1] = inside;
    u[3] = std::min(start * sigma_mm, 0.5 * most_mm);
    u[2] = first_at(line, 0.5 * (outside + peak)) + 0.5 * std::max(0.0, sigma_mm - u[3]);
    if (thick) u[kUnknowns - 1] = cortex_hu;
    const double rest = fit_line<kUnknowns>(line, u, model, limit);
    if (best && best->rest_hu <= rest) continue;
    best = CortexFit{{u[0], thick ? u[kUnknowns - 1] : cortex_hu, u[1], u[2], u[3], sigma_mm}, rest};
  }
  const CortexProfile& p = best->profile;
  const bool within =
      p.thickness_mm >= kThinnest * sigma_mm && p.outer_mm > line.first_mm && p.outer_mm + p.thickness_mm < last_mm;
  if (!within) return {};
  return best;
}

}  // namespace

double CortexProfile::blurred_hu(double at_mm) const {
  return outside_hu + (cortex_hu - outside_hu) * normal().at((at_mm - outer_mm) / sigma_mm).cumulative +
         (inside_hu - cortex_hu) * normal().at((at_mm - outer_mm - thickness_mm) / sigma_mm).cumulative;
}

std::optional<CortexFit> fit_cortex(const LineOfHu& line, double sigma_mm, double cortex_hu) {
  return fit_profile<false>(line, sigma_mm, cortex_hu);
}

std::optional<CortexFit> fit_thick_cortex(const LineOfHu& line, double sigma_mm, double cortex_guess_hu) {
  return fit_profile<true>(line, sigma_mm, cortex_guess_hu);
}

std::optional<EdgeFit> fit_edge(const LineOfHu& line, double sigma_guess_mm) {
  using Vector = Eigen::Matrix<double, 4, 1>;
  if (line.hu.size() < 2 * kEnd) return {};
  const double last_mm = line.first_mm + line.step_mm * static_cast<double>(line.hu.size() - 1);
  const double most_mm = 0.5 * (last_mm - line.first_mm), least_mm = 0.05 * sigma_guess_mm;
  const auto model = [&](const Vector& u, double at_mm, Vector& slope) {
    const double z = (at_mm - u[2]) / u[3];
    const Normal::Value edge = normal().at(z);
    slope[0] = 1.0 - edge.cumulative;
    slope[1] = edge.cumulative;
    slope[2] = -(u[1] - u[0]) * edge.density / u[3];
    slope[3] = slope[2] * z;
    return u[0] + (u[1] - u[0]) * edge.cumulative;
  };
  const auto limit = [&](Vector& u) {
    u[2] = std::clamp(u[2], line.first_mm, last_mm);
    u[3] = std::clamp(u[3], least_mm, most_mm);
  };
  Vector u;
  u[0] = mean_of(line.hu.first(kEnd));
  u[1] = mean_of(line.hu.last(kEnd));
  u[2] = first_at(line, 0.5 * (u[0] + u[1]));
  u[3] = sigma_guess_mm;
  const double rest = fit_line<4>(line, u, model, limit);
  if (u[3] <= 1.01 * least_mm || u[3] >= most_mm) return {};
  return EdgeFit{u[0], u[1], u[2], u[3], rest};
}

}  // namespace osteon::imaging
