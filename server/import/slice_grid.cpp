#include "server/import/slice_grid.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "common/core/check.hpp"

namespace osteon::import {
namespace {

constexpr double kEvenGap = 0.2;     // of the usual gap
constexpr double kEvenPlace = 0.1;   // of a step
constexpr double kSideways = 0.5;    // of a pixel
constexpr std::size_t kAround = 3;   // gaps on each side that say what is usual there
constexpr double kRounding = 1e-6;   // of a step, by which a slice may miss its plane
constexpr double kShift = 1e-3;      // of a pixel, for which the grid needs no further column
constexpr double kShownTilt = 0.05;  // degrees
constexpr float kOutside_hu = -1024.0f;

bool is_even(std::span<const double> gaps_mm, double usual_mm, double step_mm) {
  double from_first_mm = 0.0;
  for (std::size_t i = 0; i < gaps_mm.size(); ++i) {
    from_first_mm += gaps_mm[i];
    if (std::abs(gaps_mm[i] - usual_mm) > kEvenGap * usual_mm ||
        std::abs(from_first_mm - static_cast<double>(i + 1) * step_mm) > kEvenPlace * step_mm)
      return false;
  }
  return true;
}

// Where a plane's row or column lies in a slice: between two pixels, with the weight of the second. Beyond the outer
// pixels' edges there is nothing.
struct Between {
  int first = -1, second = -1;
  float weight = 0.0f;
};
std::vector<Between> between(int count, int pixels, double shift) {
  std::vector<Between> all(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const double at = i - shift;
    if (at < -0.5 || at > pixels - 0.5) continue;
    const double within = std::clamp(at, 0.0, pixels - 1.0);
    const int first = static_cast<int>(within);
    all[static_cast<std::size_t>(i)] = {first, std::min(first + 1, pixels - 1), static_cast<float>(within - first)};
  }
  return all;
}

}  // namespace

double usual_gap_mm(std::span<const double> gaps_mm) {
  OSTEON_CHECK(!gaps_mm.empty());
  std::vector<double> sorted(gaps_mm.begin(), gaps_mm.end());
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>((sorted.size() - 1) / 2);
  std::ranges::nth_element(sorted, middle);
  return *middle;
}

std::optional<std::size_t> gap_of_missing_slices(std::span<const double> gaps_mm) {
  const double usual_mm = usual_gap_mm(gaps_mm);
  std::optional<std::size_t> widest;
  for (std::size_t i = 0; i < gaps_mm.size(); ++i) {
    if (gaps_mm[i] <= kMissingSlices * usual_mm || (widest && gaps_mm[i] <= gaps_mm[*widest])) continue;
    const std::size_t first = i - std::min(i, kAround), last = std::min(gaps_mm.size(), i + kAround + 1);
    if (gaps_mm[i] > kMissingSlices * usual_gap_mm(gaps_mm.subspan(first, last - first))) widest = i;
  }
  return widest;
}

SliceGrid grid_of(const SliceStack& stack) {
  const std::size_t slices = stack.positions_mm.size();
  OSTEON_CHECK(slices >= 2);
  // Positions in the slices' own axes, from the first.
  std::vector<Vec3> from_first;
  for (const Vec3& at : stack.positions_mm)
    from_first.emplace_back(stack.directions.transpose() * (at - stack.positions_mm.front()));
  std::vector<double> gaps_mm;
  for (std::size_t i = 1; i < slices; ++i) gaps_mm.push_back(from_first[i].z() - from_first[i - 1].z());
  const double length_mm = from_first.back().z(), usual_mm = usual_gap_mm(gaps_mm);
  const auto [least, most] = std::ranges::minmax_element(gaps_mm);

  SliceGrid grid;
  grid.least_mm = *least;
  grid.most_mm = *most;
  grid.tilt_degrees = std::atan2(from_first.back().head<2>().norm(), length_mm) * 180.0 / std::numbers::pi;
  for (const Vec3& at : from_first) grid.sideways_mm = std::max(grid.sideways_mm, at.head<2>().norm());

  const double pixel_mm = std::min(stack.column_mm, stack.row_mm);
  auto steps = static_cast<double>(slices - 1);
  const bool even = is_even(gaps_mm, usual_mm, length_mm / steps);
  if (!even) steps = std::ceil(length_mm / std::max(*least, std::min(pixel_mm, usual_mm)) - kRounding);
  imaging::HuVolume& volume = grid.volume;
  volume.directions = stack.directions;
  volume.spacing_mm = {stack.column_mm, stack.row_mm, length_mm / steps};
  volume.origin_mm = stack.positions_mm.front();
  // A grid that has far too many voxels is refused by its reader.
  const double most_steps = static_cast<double>(imaging::kLargestScanAxis);
  volume.dims = {stack.columns, stack.rows, static_cast<int>(std::min(steps, most_steps)) + 1};
  const bool sideways = grid.sideways_mm > kSideways * pixel_mm;
  if (even && !sideways) return grid;

  Vec3 low = Vec3::Zero(), high = Vec3::Zero();
  for (std::size_t i = 0; i < slices; ++i) {
    Vec3 place = from_first[i].cwiseQuotient(volume.spacing_mm);
    if (even) place.z() = static_cast<double>(i);
    if (!sideways) place.head<2>().setZero();
    grid.places.push_back(place);
    low = low.cwiseMin(place);
    high = high.cwiseMax(place);
  }
  const Vec3 first(std::floor(low.x() + kShift), std::floor(low.y() + kShift), 0.0);
  volume.origin_mm = volume.position_mm(first);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    volume.dims[axis] += static_cast<int>(std::min(std::ceil(high[i] - kShift) - first[i], most_steps));
  }
  for (Vec3& place : grid.places) place -= first;
  return grid;
}

std::string irregularity(const SliceGrid& grid) {
  if (grid.places.empty()) return {};
  std::string text;
  char part[64];
  if (grid.sideways_mm > kSideways * grid.volume.spacing_mm.head<2>().minCoeff()) {
    if (grid.tilt_degrees > kShownTilt)
      std::snprintf(part, sizeof part, "tilted by %.1f degrees", grid.tilt_degrees);
    else
      std::snprintf(part, sizeof part, "up to %.3g mm sideways of each other", grid.sideways_mm);
    text = part;
  }
  if (grid.most_mm - grid.least_mm > kEvenPlace * grid.least_mm) {
    std::snprintf(part, sizeof part, "%s%.3g to %.3g mm apart", text.empty() ? "" : ", ", grid.least_mm, grid.most_mm);
    text += part;
  }
  return text;
}

SliceResampler::SliceResampler(const SliceGrid& grid, int columns, int rows)
    : grid_(grid), columns_(columns), rows_(rows) {
  OSTEON_CHECK(!grid.places.empty());
  const std::size_t pixels =
      static_cast<std::size_t>(grid.volume.dims[0]) * static_cast<std::size_t>(grid.volume.dims[1]);
  before_.resize(pixels);
  here_.resize(pixels);
  plane_.resize(pixels);
}

void SliceResampler::place(std::span<const std::int16_t> slice, const Vec3& at, std::vector<float>& plane) const {
  const auto columns = between(grid_.volume.dims[0], columns_, at.x());
  const auto rows = between(grid_.volume.dims[1], rows_, at.y());
  std::size_t n = 0;
  for (const Between& row : rows) {
    if (row.first < 0) {
      std::fill_n(plane.begin() + static_cast<std::ptrdiff_t>(n), columns.size(), kOutside_hu);
      n += columns.size();
      continue;
    }
    const std::int16_t* upper = slice.data() + static_cast<std::ptrdiff_t>(row.first) * columns_;
    const std::int16_t* lower = slice.data() + static_cast<std::ptrdiff_t>(row.second) * columns_;
    for (const Between& column : columns) {
      const auto along = [&](const std::int16_t* line) {
        return static_cast<float>(line[column.first]) * (1.0f - column.weight) +
               static_cast<float>(line[column.second]) * column.weight;
      };
      plane[n++] = column.first < 0 ? kOutside_hu : along(upper) * (1.0f - row.weight) + along(lower) * row.weight;
    }
  }
}

void SliceResampler::add(std::span<const std::int16_t> slice, const OnPlane& on_plane) {
  OSTEON_CHECK(next_slice_ < grid_.places.size());
  const Vec3& at = grid_.places[next_slice_];
  std::swap(before_, here_);
  place(slice, at, here_);
  const double below = next_slice_ == 0 ? at.z() - 1.0 : grid_.places[next_slice_ - 1].z();
  ++next_slice_;
  for (; next_plane_ < grid_.volume.dims[2] && next_plane_ <= at.z() + kRounding * grid_.volume.dims[2];
       ++next_plane_) {
    const auto weight = static_cast<float>(std::clamp((next_plane_ - below) / (at.z() - below), 0.0, 1.0));
    for (std::size_t i = 0; i < plane_.size(); ++i)
      plane_[i] = static_cast<std::int16_t>(std::lround(before_[i] * (1.0f - weight) + here_[i] * weight));
    on_plane(plane_);
  }
}

}  // namespace osteon::import
