#include "common/imaging/smoothing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "common/core/check.hpp"

namespace osteon::imaging {
namespace {

using Hu = std::int16_t;

constexpr double kSigmas = 4.0;         // where the weights end
constexpr double kLeastSigma = 0.1;     // of the spacing
constexpr std::size_t kMedianRows = 9;  // around a row, in 3 slices
constexpr std::size_t kPart = 256;      // of a row
constexpr std::size_t kBlock = 16;      // sums that fit into registers

// The weights of a voxel and of its neighbours on one side. They sum up to 1 over both sides.
std::vector<float> gaussian_weights(double sigma) {
  if (sigma < kLeastSigma) return {1.0f};
  const auto reach = static_cast<std::size_t>(std::ceil(kSigmas * sigma));
  std::vector<double> weights(reach + 1);
  double sum = 0.0;
  for (std::size_t i = 0; i <= reach; ++i) {
    const double x = static_cast<double>(i) / sigma;
    weights[i] = std::exp(-0.5 * x * x);
    sum += i == 0 ? weights[i] : 2.0 * weights[i];
  }
  std::vector<float> out;
  for (const double weight : weights) out.push_back(static_cast<float>(weight / sum));
  return out;
}

// A slice with the nearest voxel repeated once around it.
class PaddedSlice {
 public:
  PaddedSlice(int columns, int rows)
      : columns_(static_cast<std::size_t>(columns)),
        rows_(static_cast<std::size_t>(rows)),
        values_((columns_ + 2) * rows_) {}

  void set(const Hu* from) {
    for (std::size_t y = 0; y < rows_; ++y, from += columns_) {
      Hu* row = values_.data() + y * (columns_ + 2);
      row[0] = from[0];
      std::copy_n(from, columns_, row + 1);
      row[columns_ + 1] = from[columns_ - 1];
    }
  }
  // The voxel before the first one of row `y`, clamped.
  [[nodiscard]] const Hu* row(int y) const {
    const auto clamped = static_cast<std::size_t>(std::clamp(y, 0, static_cast<int>(rows_) - 1));
    return values_.data() + clamped * (columns_ + 2);
  }

 private:
  std::size_t columns_, rows_;
  std::vector<Hu> values_;
};

// out[i] = weights[0] * middle[0][i] + weights[d] * (middle[-d][i] + middle[d][i]) over all d > 0, for `n` values from
// `x` on.
template <std::size_t n>
void sum_block(std::span<const float> weights, const float* const* middle, std::size_t x, float* __restrict out) {
  std::array<float, n> sum;
  for (std::size_t i = 0; i < n; ++i) sum[i] = weights[0] * middle[0][x + i];
  for (std::size_t d = 1; d < weights.size(); ++d) {
    const float *before = *(middle - d) + x, *after = middle[d] + x;
    for (std::size_t i = 0; i < n; ++i) sum[i] += weights[d] * (before[i] + after[i]);
  }
  for (std::size_t i = 0; i < n; ++i) out[x + i] = sum[i];
}

// The same for a whole row of `n` values, in blocks whose sums stay in registers.
void sum_row(std::span<const float> weights, const std::vector<const float*>& rows, std::size_t n,
             float* __restrict out) {
  const float* const* middle = rows.data() + rows.size() / 2;
  std::size_t x = 0;
  for (; x + kBlock <= n; x += kBlock) sum_block<kBlock>(weights, middle, x, out);
  for (; x < n; ++x) sum_block<1>(weights, middle, x, out);
}

void round_row(const float* __restrict from, std::size_t n, Hu* __restrict to) {
  for (std::size_t i = 0; i < n; ++i) to[i] = static_cast<Hu>(static_cast<int>(from[i] + (from[i] < 0 ? -0.5f : 0.5f)));
}

// Smooths slices in their order, in place. Each row is smoothed along slices first, so that only a few rows of sums
// must be kept.
class Gaussian {
 public:
  Gaussian(HuVolume& volume, double sigma_mm)
      : volume_(volume),
        columns_(static_cast<std::size_t>(volume.dims[0])),
        along_rows_(gaussian_weights(sigma_mm / volume.spacing_mm[0])),
        along_columns_(gaussian_weights(sigma_mm / volume.spacing_mm[1])),
        along_slices_(gaussian_weights(sigma_mm / volume.spacing_mm[2])),
        original_(std::min(2 * along_slices_.size() - 1, static_cast<std::size_t>(volume.dims[2])),
                  std::vector<float>(columns_ * static_cast<std::size_t>(volume.dims[1]))),
        across_(columns_ + 2 * reach(along_rows_)),
        within_(std::min(2 * along_columns_.size() - 1, static_cast<std::size_t>(volume.dims[1])),
                std::vector<float>(columns_)),
        row_(columns_) {}

  // `slice`: the one behind the last.
  void apply(int slice) {
    const int farthest = std::min(slice + static_cast<int>(reach(along_slices_)), volume_.dims[2] - 1);
    while (last_original_ < farthest) {
      std::vector<float>& next = original(++last_original_);
      std::copy_n(slice_row(last_original_, 0), next.size(), next.data());
    }
    const int last = volume_.dims[1] - 1, reach_y = static_cast<int>(reach(along_columns_));
    for (int y = 0, done = -1; y <= last; ++y) {
      for (; done < std::min(y + reach_y, last); ++done) smooth_within(slice, done + 1);
      const auto rows = neighbours(along_columns_, y, last, [&](int at) { return within(at).data(); });
      sum_row(along_columns_, rows, columns_, row_.data());
      round_row(row_.data(), columns_, slice_row(slice, y));
    }
  }

 private:
  static std::size_t reach(const std::vector<float>& weights) { return weights.size() - 1; }

  // The rows around `middle`, the nearest one instead of those beyond the edge.
  template <class Row>
  static std::vector<const float*> neighbours(const std::vector<float>& weights, int middle, int last, const Row& row) {
    std::vector<const float*> rows;
    const int far = static_cast<int>(reach(weights));
    for (int at = middle - far; at <= middle + far; ++at) rows.push_back(row(std::clamp(at, 0, last)));
    return rows;
  }

  // Along slices, then along the row.
  void smooth_within(int slice, int y) {
    const auto rows = neighbours(along_slices_, slice, volume_.dims[2] - 1,
                                 [&](int at) { return original(at).data() + static_cast<std::size_t>(y) * columns_; });
    const std::size_t margin = reach(along_rows_);
    float* across = across_.data() + margin;
    sum_row(along_slices_, rows, columns_, across);
    std::fill_n(across_.data(), margin, across[0]);
    std::fill_n(across + columns_, margin, across[columns_ - 1]);
    std::vector<const float*> shifted;
    for (std::size_t d = 0; d <= 2 * margin; ++d) shifted.push_back(across_.data() + d);
    sum_row(along_rows_, shifted, columns_, within(y).data());
  }

  Hu* slice_row(int slice, int y) { return volume_.values.data() + volume_.index(0, y, slice); }
  std::vector<float>& original(int slice) { return original_[static_cast<std::size_t>(slice) % original_.size()]; }
  std::vector<float>& within(int y) { return within_[static_cast<std::size_t>(y) % within_.size()]; }

  HuVolume& volume_;
  std::size_t columns_;
  std::vector<float> along_rows_, along_columns_, along_slices_;
  std::vector<std::vector<float>> original_;  // slices from the first to the last neighbour, in turns
  std::vector<float> across_;                 // a row smoothed along slices, with the nearest value repeated around it
  std::vector<std::vector<float>> within_;    // rows smoothed along slices and along themselves, in turns
  std::vector<float> row_;
  int last_original_ = -1;  // the last slice in `original_`
};

// Branches would keep these loops from being vectorised.
constexpr Hu low(Hu a, Hu b) { return a < b ? a : b; }
constexpr Hu high(Hu a, Hu b) { return a < b ? b : a; }
constexpr void sort(Hu& a, Hu& b) {
  const Hu least = low(a, b);
  b = high(a, b);
  a = least;
}
constexpr Hu middle(Hu a, Hu b, Hu c) { return high(low(a, b), low(high(a, b), c)); }

// Sorts nine values with the 25 exchanges of Floyd's network (Knuth, volume 3, 5.3.4).
constexpr void sort(std::array<Hu, 9>& v) {
  constexpr std::array<std::pair<std::size_t, std::size_t>, 25> kExchanges{
      {{0, 1}, {3, 4}, {6, 7}, {1, 2}, {4, 5}, {7, 8}, {0, 1}, {3, 4}, {6, 7}, {0, 3}, {3, 6}, {0, 3}, {1, 4},
       {4, 7}, {1, 4}, {2, 5}, {5, 8}, {2, 5}, {1, 3}, {5, 7}, {2, 6}, {4, 6}, {2, 4}, {2, 3}, {5, 6}}};
  // Unrolled here, because the compiler unrolls no loop of this length, and then does not vectorise the one around it.
  [&]<std::size_t... i>(std::index_sequence<i...>) { (sort(v[kExchanges[i].first], v[kExchanges[i].second]), ...); }
  (std::make_index_sequence<kExchanges.size()>());
}

// The median of three sorted lists of nine. At each rank take the lowest, the middle and the highest of the three
// lists. Of these 27, seven have at least 15 above or equal to them and seven at least 15 below; the median is that of
// the 13 others: the lowest of ranks 5 to 8, the middle ones of ranks 2 to 6, and the highest of ranks 0 to 3.
constexpr Hu median(const std::array<Hu, 9>& a, const std::array<Hu, 9>& b, const std::array<Hu, 9>& c) {
  const auto lowest = [&](std::size_t i) { return low(low(a[i], b[i]), c[i]); };
  const auto highest = [&](std::size_t i) { return high(high(a[i], b[i]), c[i]); };
  const auto mid = [&](std::size_t i) { return middle(a[i], b[i], c[i]); };
  // Batcher's merge of the four lowest and the four highest.
  std::array<Hu, 8> v{lowest(5), lowest(6), lowest(7), lowest(8), highest(0), highest(1), highest(2), highest(3)};
  for (const auto& [i, j] : std::array<std::pair<std::size_t, std::size_t>, 9>{
           {{0, 4}, {1, 5}, {2, 6}, {3, 7}, {2, 4}, {3, 5}, {1, 2}, {3, 4}, {5, 6}}})
    sort(v[i], v[j]);
  // The seventh of 8 + 5 sorted values: for each number taken from `v`, the larger of the two last ones taken.
  const std::array<Hu, 5> m{mid(2), mid(3), mid(4), mid(5), mid(6)};
  Hu found = v[6];
  for (std::size_t i = 1; i < 6; ++i) found = low(found, high(v[i], m[5 - i]));
  return found;
}

// The medians of a part of a row. `rows`: the nine rows of its boxes, from one voxel before the part to one behind it.
// `n`: at most kPart. The columns are sorted first, because three boxes share each.
void median_of_rows(const std::array<const Hu*, kMedianRows>& rows, std::size_t n, Hu* __restrict out) {
  // A distance between the rows that the compiler knows lets it vectorise.
  std::array<std::array<Hu, kPart + 2>, kMedianRows> sorted;
  const auto [r0, r1, r2, r3, r4, r5, r6, r7, r8] = rows;
  for (std::size_t x = 0; x < n + 2; ++x) {
    std::array<Hu, 9> v{r0[x], r1[x], r2[x], r3[x], r4[x], r5[x], r6[x], r7[x], r8[x]};
    sort(v);
    sorted[0][x] = v[0];
    sorted[1][x] = v[1];
    sorted[2][x] = v[2];
    sorted[3][x] = v[3];
    sorted[4][x] = v[4];
    sorted[5][x] = v[5];
    sorted[6][x] = v[6];
    sorted[7][x] = v[7];
    sorted[8][x] = v[8];
  }
  const auto column = [&](std::size_t x) {
    return std::array<Hu, 9>{sorted[0][x], sorted[1][x], sorted[2][x], sorted[3][x], sorted[4][x],
                             sorted[5][x], sorted[6][x], sorted[7][x], sorted[8][x]};
  };
  for (std::size_t x = 0; x < n; ++x) out[x] = median(column(x), column(x + 1), column(x + 2));
}

// Of three rows: at each column the three values in order, then the median of three such columns. The highest of the
// lowest, the middle of the middle ones, the lowest of the highest: the median is the middle of these.
void median_of_slice(const Hu* __restrict above, const Hu* __restrict here, const Hu* __restrict below, std::size_t n,
                     Hu* __restrict out) {
  for (std::size_t x = 0; x < n; ++x) {
    Hu lowest = std::numeric_limits<Hu>::min(), highest = std::numeric_limits<Hu>::max();
    std::array<Hu, 3> middles{};
    for (std::size_t d = 0; d < 3; ++d) {
      const Hu a = above[x + d], b = here[x + d], c = below[x + d];
      lowest = high(lowest, low(low(a, b), c));
      highest = low(highest, high(high(a, b), c));
      middles[d] = middle(a, b, c);
    }
    out[x] = middle(lowest, middle(middles[0], middles[1], middles[2]), highest);
  }
}

}  // namespace

Result<void> smooth_gaussian(HuVolume& volume, double sigma_mm, const KeepGoing& keep_going) {
  OSTEON_CHECK(sigma_mm > 0.0);
  Gaussian gaussian(volume, sigma_mm);
  for (int slice = 0; slice < volume.dims[2]; ++slice) {
    if (!keep_going(static_cast<double>(slice) / volume.dims[2])) return stopped_while("smoothing the scan");
    gaussian.apply(slice);
  }
  return {};
}

Result<void> smooth_median(HuVolume& volume, MedianBox box, const KeepGoing& keep_going) {
  const auto columns = static_cast<std::size_t>(volume.dims[0]);
  const int last = volume.dims[2] - 1;
  std::vector<PaddedSlice> near(3, PaddedSlice(volume.dims[0], volume.dims[1]));
  const auto kept = [&](int slice) -> PaddedSlice& { return near[static_cast<std::size_t>(slice) % 3]; };
  kept(0).set(volume.values.data());
  for (int slice = 0; slice <= last; ++slice) {
    if (!keep_going(static_cast<double>(slice) / volume.dims[2])) return stopped_while("smoothing the scan");
    if (slice < last) kept(slice + 1).set(volume.values.data() + volume.index(0, 0, slice + 1));
    for (int y = 0; y < volume.dims[1]; ++y) {
      Hu* out = volume.values.data() + volume.index(0, y, slice);
      const auto row = [&](int dy, int dz) { return kept(std::clamp(slice + dz, 0, last)).row(y + dy); };
      if (box == MedianBox::slice) {
        median_of_slice(row(-1, 0), row(0, 0), row(1, 0), columns, out);
        continue;
      }
      const std::array<const Hu*, kMedianRows> rows{row(-1, -1), row(0, -1), row(1, -1), row(-1, 0), row(0, 0),
                                                    row(1, 0),   row(-1, 1), row(0, 1),  row(1, 1)};
      for (std::size_t x = 0; x < columns; x += kPart) {
        std::array<const Hu*, kMedianRows> part = rows;
        for (const Hu*& from : part) from += x;
        median_of_rows(part, std::min(kPart, columns - x), out + x);
      }
    }
  }
  return {};
}

}  // namespace osteon::imaging
