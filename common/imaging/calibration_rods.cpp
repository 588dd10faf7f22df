#include "common/imaging/calibration_rods.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>

#include "common/imaging/components.hpp"

namespace osteon::imaging {
namespace {

constexpr std::size_t kLeastRods = 2, kMostRods = 8;
constexpr int kMostBlocks = 8;                              // the slices are averaged in so many blocks
constexpr double kLeastDisc_mm = 4.0, kMostDisc_mm = 40.0;  // diameter
constexpr double kLeastDisc_pixels = 12.0;
constexpr double kLeastRod_hu = -300.0;  // below it is a bubble
// A disc has equal second moments along all directions, and an area of 4π times their geometric mean.
constexpr double kMostOval = 1.5, kLeastRound = 0.9;
// A disc is where the HU change by less than so many HU from pixel to pixel, or less than a multiple of the noise.
constexpr double kFlat_hu = 3.0, kFlatNoise = 4.0, kNoiseQuantile = 0.25;
// Discs of neighbouring blocks are one rod if they differ by no more.
constexpr double kSamePlace_mm = 3.0, kSame_hu = 20.0, kSameWidth = 0.3;
constexpr double kLeastRun = 0.5;       // of the blocks
constexpr std::size_t kMostDiscs = 14;  // candidates that are compared with the densities
constexpr double kMost_hu_per_g_cm3 = 3000.0, kLeast_hu_per_g_cm3 = 400.0;
// Differences that count as much as each other when candidates are compared: of the HU from the line, of the widths,
// and of the places from a row, as a part of the row's length.
constexpr double kUsual_hu = 10.0, kUsualWidth = 0.1, kUsualRow = 0.2;
constexpr double kMostMisfit = 2.0;  // sum of the squares of these; more is other things than rods
constexpr double kReadPart = 0.8;    // of a disc's radius

// Slices of which one mean image is made.
struct Block {
  int first, last;
};

struct Disc {
  double column = 0.0, row = 0.0, hu = 0.0, diameter_mm = 0.0;
};

// One disc in each of several blocks, one after the other.
struct Run {
  int first_block = 0;
  std::vector<Disc> discs;

  [[nodiscard]] Disc mean() const {
    Disc sum;
    const double n = static_cast<double>(discs.size());
    for (const Disc& d : discs) {
      sum.column += d.column / n;
      sum.row += d.row / n;
      sum.hu += d.hu / n;
      sum.diameter_mm += d.diameter_mm / n;
    }
    return sum;
  }
};

std::vector<Block> blocks_of(int slices) {
  const int count = std::min(slices, kMostBlocks);
  std::vector<Block> blocks;
  for (int i = 0; i < count; ++i) blocks.push_back({i * slices / count, (i + 1) * slices / count - 1});
  return blocks;
}

// The mean of the slices of a block, smoothed with the binomial filter 1 4 6 4 1, whose sigma is one pixel.
std::vector<float> mean_image(const HuVolume& volume, const Block& block) {
  const int columns = volume.dims[0], rows = volume.dims[1];
  const std::size_t area = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  std::vector<float> mean(area, 0.0f), other(area);
  const float part = 1.0f / static_cast<float>(block.last - block.first + 1);
  for (int slice = block.first; slice <= block.last; ++slice) {
    const std::int16_t* hu = volume.values.data() + volume.index(0, 0, slice);
    for (std::size_t i = 0; i < area; ++i) mean[i] += part * static_cast<float>(hu[i]);
  }
  const auto filter = [&](const std::vector<float>& from, std::vector<float>& to, int dx, int dy) {
    constexpr float kWeights[] = {0.0625f, 0.25f, 0.375f, 0.25f, 0.0625f};
    for (int y = 0; y < rows; ++y)
      for (int x = 0; x < columns; ++x) {
        float sum = 0.0f;
        for (int k = -2; k <= 2; ++k) {
          const int cx = std::clamp(x + k * dx, 0, columns - 1), cy = std::clamp(y + k * dy, 0, rows - 1);
          sum += kWeights[k + 2] *
                 from[static_cast<std::size_t>(cy) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(cx)];
        }
        to[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(x)] = sum;
      }
  };
  filter(mean, other, 1, 0);
  filter(other, mean, 0, 1);
  return mean;
}

// 1 where an image is flat. The image's noise is judged where it changes least.
VoxelMask flat_parts(const std::vector<float>& image, int columns, int rows) {
  std::vector<float> change(image.size(), 0.0f);
  const auto at = [&](int x, int y) {
    return image[static_cast<std::size_t>(std::clamp(y, 0, rows - 1)) * static_cast<std::size_t>(columns) +
                 static_cast<std::size_t>(std::clamp(x, 0, columns - 1))];
  };
  std::vector<float> in_bodies;
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      const std::size_t i =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(x);
      change[i] = 0.5f * std::hypot(at(x + 1, y) - at(x - 1, y), at(x, y + 1) - at(x, y - 1));
      if (image[i] > static_cast<float>(kLeastRod_hu)) in_bodies.push_back(change[i]);
    }
  VoxelMask flat({columns, rows, 1});
  if (in_bodies.empty()) return flat;
  const auto middle =
      in_bodies.begin() + static_cast<std::ptrdiff_t>(kNoiseQuantile * static_cast<double>(in_bodies.size()));
  std::ranges::nth_element(in_bodies, middle);
  const double limit = std::max(kFlat_hu, kFlatNoise * static_cast<double>(*middle));
  for (std::size_t i = 0; i < image.size(); ++i)
    flat.values[i] = change[i] < limit && image[i] > static_cast<float>(kLeastRod_hu) ? 1 : 0;
  return flat;
}

// Sums over the pixels of a component.
struct Moments {
  double n = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0, hu = 0;

  // The disc that they are, if they are one. `pixel_mm`: width and height of a pixel.
  [[nodiscard]] std::optional<Disc> disc(double width_mm, double height_mm) const {
    if (n < kLeastDisc_pixels) return {};
    const double cx = x / n, cy = y / n;
    const double vx = (xx / n - cx * cx) * width_mm * width_mm, vy = (yy / n - cy * cy) * height_mm * height_mm;
    const double vxy = (xy / n - cx * cy) * width_mm * height_mm, determinant = vx * vy - vxy * vxy;
    if (!(determinant > 0.0)) return {};
    const double half = 0.5 * (vx + vy), apart = std::sqrt(std::max(0.0, half * half - determinant));
    const double area = n * width_mm * height_mm, diameter = std::sqrt(4.0 * area / std::numbers::pi);
    if (half + apart > kMostOval * (half - apart)) return {};
    if (area < kLeastRound * 4.0 * std::numbers::pi * std::sqrt(determinant)) return {};
    if (diameter < kLeastDisc_mm || diameter > kMostDisc_mm) return {};
    return Disc{cx, cy, hu / n, diameter};
  }
};

Result<std::vector<Disc>> discs_of(const HuVolume& volume, const Block& block, const KeepGoing& keep_going) {
  const std::vector<float> image = mean_image(volume, block);
  const VoxelMask flat = flat_parts(image, volume.dims[0], volume.dims[1]);
  std::bitset<256> one;
  one.set(1);
  const auto parts = find_components(flat, one, Connectivity::faces, keep_going);
  if (!parts) return tl::unexpected(parts.error());
  std::vector<Moments> moments(parts->count);
  for (const VoxelRun& run : parts->runs)
    for (int x = run.first; x <= run.last; ++x) {
      Moments& m = moments[run.component];
      m.n += 1.0;
      m.x += x;
      m.y += run.row;
      m.xx += static_cast<double>(x) * x;
      m.yy += static_cast<double>(run.row) * run.row;
      m.xy += static_cast<double>(x) * run.row;
      m.hu += static_cast<double>(image[flat.index(x, run.row, 0)]);
    }
  std::vector<Disc> discs;
  for (const Moments& m : moments)
    if (const auto disc = m.disc(volume.spacing_mm.x(), volume.spacing_mm.y())) discs.push_back(*disc);
  return discs;
}

double apart_mm(const HuVolume& volume, const Disc& a, const Disc& b) {
  return std::hypot((a.column - b.column) * volume.spacing_mm.x(), (a.row - b.row) * volume.spacing_mm.y());
}

// Joins the discs of a block to the runs that end in the block before, or begins new runs.
void join(const HuVolume& volume, int block, const std::vector<Disc>& discs, std::vector<Run>& runs) {
  for (const Disc& disc : discs) {
    Run* nearest = nullptr;
    double least = kSamePlace_mm;
    for (Run& run : runs) {
      if (run.first_block + static_cast<int>(run.discs.size()) != block) continue;
      const Disc& last = run.discs.back();
      if (std::abs(last.hu - disc.hu) > kSame_hu ||
          std::abs(last.diameter_mm - disc.diameter_mm) > kSameWidth * std::max(last.diameter_mm, disc.diameter_mm))
        continue;
      const double apart = apart_mm(volume, last, disc);
      if (apart > least) continue;
      least = apart;
      nearest = &run;
    }
    if (nearest != nullptr)
      nearest->discs.push_back(disc);
    else
      runs.push_back({block, {disc}});
  }
}

// How badly some discs fit as the rods, in order of their HU; infinite if they cannot be the rods.
double misfit(const HuVolume& volume, const std::vector<Disc>& discs, std::span<const double> densities) {
  std::vector<DensityReading> readings;
  double width = 0.0, widths = 0.0, length = 0.0;
  for (std::size_t i = 0; i < discs.size(); ++i) {
    readings.push_back({densities[i], discs[i].hu});
    width += discs[i].diameter_mm / static_cast<double>(discs.size());
  }
  const auto line = fit_calibration(readings);
  if (!line || line->hu_per_g_cm3 < kLeast_hu_per_g_cm3 || line->hu_per_g_cm3 > kMost_hu_per_g_cm3)
    return std::numeric_limits<double>::infinity();
  std::size_t end = 0, other = 0;
  for (std::size_t i = 0; i < discs.size(); ++i) {
    widths += std::pow(discs[i].diameter_mm / width - 1.0, 2) / static_cast<double>(discs.size());
    for (std::size_t j = 0; j < i; ++j)
      if (const double apart = apart_mm(volume, discs[i], discs[j]); apart > length) {
        length = apart;
        end = i;
        other = j;
      }
  }
  // Distances from the line between the two that are farthest apart.
  double beside = 0.0;
  const double dx = (discs[end].column - discs[other].column) * volume.spacing_mm.x() / length,
               dy = (discs[end].row - discs[other].row) * volume.spacing_mm.y() / length;
  for (const Disc& d : discs) {
    const double x = (d.column - discs[other].column) * volume.spacing_mm.x(),
                 y = (d.row - discs[other].row) * volume.spacing_mm.y();
    beside = std::max(beside, std::abs(x * dy - y * dx) / length);
  }
  return std::pow(line->deviation_hu / kUsual_hu, 2) + widths / (kUsualWidth * kUsualWidth) +
         std::pow(beside / kUsualRow, 2);
}

// The runs that fit best, in order of the densities; empty if none can be the rods.
std::vector<Run> chosen(const HuVolume& volume, std::vector<Run> runs, std::span<const double> densities) {
  std::ranges::stable_sort(runs, std::ranges::greater{}, [](const Run& r) { return r.discs.size(); });
  if (runs.size() > kMostDiscs) runs.resize(kMostDiscs);
  std::ranges::stable_sort(runs, std::ranges::less{}, [](const Run& r) { return r.mean().hu; });
  std::vector<Run> best;
  double least = kMostMisfit;
  for (std::uint32_t set = 0; set < 1u << runs.size(); ++set) {
    if (static_cast<std::size_t>(std::popcount(set)) != densities.size()) continue;
    std::vector<Disc> discs;
    for (std::size_t i = 0; i < runs.size(); ++i)
      if ((set >> i & 1u) != 0) discs.push_back(runs[i].mean());
    const double here = misfit(volume, discs, densities);
    if (!(here < least)) continue;
    least = here;
    best.clear();
    for (std::size_t i = 0; i < runs.size(); ++i)
      if ((set >> i & 1u) != 0) best.push_back(runs[i]);
  }
  return best;
}

// Reads a rod from the scan itself, within its discs.
CalibrationRod read_rod(const HuVolume& volume, const Run& run, const std::vector<Block>& blocks, double density) {
  CalibrationRod rod;
  double n = 0.0, sum = 0.0, squares = 0.0;
  for (std::size_t b = 0; b < run.discs.size(); ++b) {
    const Disc& disc = run.discs[b];
    const Block& block = blocks[static_cast<std::size_t>(run.first_block) + b];
    const double radius_mm = 0.5 * kReadPart * disc.diameter_mm;
    const int dx = static_cast<int>(radius_mm / volume.spacing_mm.x()) + 1;
    const int dy = static_cast<int>(radius_mm / volume.spacing_mm.y()) + 1;
    const int cx = static_cast<int>(std::lround(disc.column)), cy = static_cast<int>(std::lround(disc.row));
    for (int slice = block.first; slice <= block.last; ++slice)
      for (int y = std::max(0, cy - dy); y <= std::min(volume.dims[1] - 1, cy + dy); ++y)
        for (int x = std::max(0, cx - dx); x <= std::min(volume.dims[0] - 1, cx + dx); ++x) {
          if (std::hypot((x - disc.column) * volume.spacing_mm.x(), (y - disc.row) * volume.spacing_mm.y()) > radius_mm)
            continue;
          const double hu = volume.at(x, y, slice);
          n += 1.0;
          sum += hu;
          squares += hu * hu;
        }
  }
  rod.reading = {density, sum / n};
  rod.deviation_hu = std::sqrt(std::max(0.0, squares / n - rod.reading.hu * rod.reading.hu));
  const Disc mean = run.mean();
  const int first = blocks[static_cast<std::size_t>(run.first_block)].first;
  const int last = blocks[static_cast<std::size_t>(run.first_block) + run.discs.size() - 1].last;
  rod.centre_mm = volume.position_mm(Vec3(mean.column, mean.row, 0.5 * (first + last)));
  rod.diameter_mm = kReadPart * mean.diameter_mm;
  rod.length_mm = (last - first + 1) * volume.spacing_mm.z();
  return rod;
}

}  // namespace

Result<std::vector<CalibrationRod>> find_rods(const HuVolume& volume, std::span<const double> densities_g_cm3,
                                              const KeepGoing& keep_going) {
  std::vector<double> densities(densities_g_cm3.begin(), densities_g_cm3.end());
  std::ranges::sort(densities);
  if (densities.size() < kLeastRods || densities.size() > kMostRods ||
      std::ranges::adjacent_find(densities) != densities.end())
    return bad_input("the rods are two to eight different densities in g/cm3, such as 0,0.1,0.2");
  const std::vector<Block> blocks = blocks_of(volume.dims[2]);
  std::vector<Run> runs;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const double begin = static_cast<double>(b) / static_cast<double>(blocks.size());
    if (!keep_going(begin)) return stopped_while("looking for the rods");
    const auto discs = discs_of(volume, blocks[b], [&](double) { return keep_going(begin); });
    if (!discs) return tl::unexpected(discs.error());
    join(volume, static_cast<int>(b), *discs, runs);
  }
  std::erase_if(runs, [&](const Run& run) {
    return static_cast<double>(run.discs.size()) < kLeastRun * static_cast<double>(blocks.size());
  });
  const std::vector<Run> rods = chosen(volume, std::move(runs), densities);
  if (rods.empty())
    return bad_input(
        "the scan does not show " + std::to_string(densities.size()) +
        " uniform rods along its slices whose HU rise with those densities; give the line by --calibration");
  std::vector<CalibrationRod> found;
  for (std::size_t i = 0; i < rods.size(); ++i) found.push_back(read_rod(volume, rods[i], blocks, densities[i]));
  return found;
}

}  // namespace osteon::imaging
