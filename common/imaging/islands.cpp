#include "common/imaging/islands.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace osteon::imaging {
namespace {

// A stretch of bone voxels within one row of the volume.
struct Run {
  std::int32_t first = 0;
  std::int32_t last = 0;
};

// Union-find over runs; the smaller number is the root, so results do not depend on the order of unions.
class Forest {
 public:
  void add() { parent_.push_back(static_cast<std::uint32_t>(parent_.size())); }
  std::uint32_t root(std::uint32_t i) {
    while (parent_[i] != i) {
      parent_[i] = parent_[parent_[i]];
      i = parent_[i];
    }
    return i;
  }
  void unite(std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    if (a != b) parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace

Result<IslandReport> keep_largest_island(HuVolume& volume, double threshold_hu, const KeepGoing& keep_going) {
  const auto [columns, rows, slices] = volume.dims;
  const auto stopped = [] { return failure(ErrorCode::cancelled, "stopped while looking for the bone"); };

  // Runs row by row; row_begin[r] is the first run of row r = slice · rows + row.
  std::vector<Run> runs;
  std::vector<std::uint32_t> row_begin;
  row_begin.reserve(static_cast<std::size_t>(rows) * static_cast<std::size_t>(slices) + 1);
  Forest forest;
  for (int slice = 0; slice < slices; ++slice) {
    if (!keep_going(0.8 * slice / slices)) return stopped();
    for (int row = 0; row < rows; ++row) {
      row_begin.push_back(static_cast<std::uint32_t>(runs.size()));
      const std::int16_t* hu = volume.values.data() + volume.index(0, row, slice);
      for (int i = 0; i < columns; ++i) {
        if (hu[i] < threshold_hu) continue;
        const int first = i;
        while (i + 1 < columns && hu[i + 1] >= threshold_hu) ++i;
        runs.push_back({first, i});
        forest.add();
      }
      // Touching runs of the four rows before this one: a column more at either end, for the diagonals.
      const auto end = static_cast<std::uint32_t>(runs.size());
      const auto join = [&, rows = rows](int other_row, int other_slice) {
        if (other_row < 0 || other_row >= rows || other_slice < 0) return;
        const std::size_t r = static_cast<std::size_t>(other_slice) * static_cast<std::size_t>(rows) + static_cast<std::size_t>(other_row);
        std::uint32_t a = row_begin[r];
        const std::uint32_t a_end = row_begin[r + 1];
        std::uint32_t b = row_begin.back();
        while (a < a_end && b < end) {
          if (runs[a].first <= runs[b].last + 1 && runs[b].first <= runs[a].last + 1) forest.unite(a, b);
          (runs[a].last < runs[b].last) ? ++a : ++b;
        }
      };
      join(row - 1, slice);
      for (int other = row - 1; other <= row + 1; ++other) join(other, slice - 1);
    }
  }
  row_begin.push_back(static_cast<std::uint32_t>(runs.size()));

  IslandReport report;
  if (runs.empty())
    return failure(ErrorCode::invalid_input, "no voxel reaches the bone threshold of " +
                                                 std::to_string(std::lround(threshold_hu)) + " HU; give a lower --threshold");

  std::vector<std::int64_t> size(runs.size(), 0);
  for (std::uint32_t i = 0; i < runs.size(); ++i) size[forest.root(i)] += runs[i].last - runs[i].first + 1;
  const auto largest = static_cast<std::uint32_t>(std::max_element(size.begin(), size.end()) - size.begin());
  report.islands = std::count_if(size.begin(), size.end(), [](std::int64_t n) { return n > 0; });
  report.kept_voxels = size[largest];
  report.removed_voxels = std::accumulate(size.begin(), size.end(), std::int64_t{0}) - report.kept_voxels;

  report.first = volume.dims;
  report.last = {-1, -1, -1};
  const auto below = static_cast<std::int16_t>(std::ceil(threshold_hu) - 1);
  for (int slice = 0; slice < slices; ++slice) {
    if (!keep_going(0.8 + 0.2 * slice / slices)) return stopped();
    for (int row = 0; row < rows; ++row) {
      const std::size_t r = static_cast<std::size_t>(slice) * static_cast<std::size_t>(rows) + static_cast<std::size_t>(row);
      for (std::uint32_t i = row_begin[r]; i < row_begin[r + 1]; ++i) {
        if (forest.root(i) == largest) {
          report.first = {std::min(report.first[0], runs[i].first), std::min(report.first[1], row), std::min(report.first[2], slice)};
          report.last = {std::max(report.last[0], runs[i].last), std::max(report.last[1], row), std::max(report.last[2], slice)};
        } else {
          const auto begin = volume.values.begin() + static_cast<std::ptrdiff_t>(volume.index(runs[i].first, row, slice));
          std::fill(begin, begin + (runs[i].last - runs[i].first + 1), below);
        }
      }
    }
  }
  return report;
}

}  // namespace osteon::imaging
