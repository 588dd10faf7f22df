#include "common/imaging/components.hpp"

#include <algorithm>

namespace osteon::imaging {
namespace {

// Union-find over runs. The smallest number is the root, so the result does not depend on the order of unions.
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

std::vector<std::int64_t> Components::voxels() const {
  std::vector<std::int64_t> size(count, 0);
  for (const VoxelRun& run : runs) size[run.component] += run.last - run.first + 1;
  return size;
}

Result<Components> find_components(const VoxelMask& mask, const std::bitset<256>& of, Connectivity connectivity,
                                   const KeepGoing& keep_going) {
  const auto [columns, rows, slices] = mask.dims;
  std::array<bool, 256> wanted{};
  for (std::size_t i = 0; i < wanted.size(); ++i) wanted[i] = of[i];
  const std::int32_t reach = connectivity == Connectivity::corners ? 1 : 0;  // diagonals: one more column at either end

  Components found;
  std::vector<VoxelRun>& runs = found.runs;
  std::vector<std::uint32_t> row_begin;  // of row r = slice · rows + row
  row_begin.reserve(static_cast<std::size_t>(rows) * static_cast<std::size_t>(slices) + 1);
  Forest forest;
  for (int slice = 0; slice < slices; ++slice) {
    if (!keep_going(static_cast<double>(slice) / slices)) return stopped_while("looking for connected voxels");
    for (int row = 0; row < rows; ++row) {
      row_begin.push_back(static_cast<std::uint32_t>(runs.size()));
      const std::uint8_t* value = mask.values.data() + mask.index(0, row, slice);
      for (int i = 0; i < columns; ++i) {
        if (!wanted[value[i]]) continue;
        const int first = i;
        while (i + 1 < columns && wanted[value[i + 1]]) ++i;
        runs.push_back({first, i, row, slice, 0});
        forest.add();
      }
      const auto end = static_cast<std::uint32_t>(runs.size());
      const auto join = [&, rows = rows](int other_row, int other_slice) {
        if (other_row < 0 || other_row >= rows || other_slice < 0) return;
        const std::size_t r = static_cast<std::size_t>(other_slice) * static_cast<std::size_t>(rows) +
                              static_cast<std::size_t>(other_row);
        std::uint32_t a = row_begin[r], b = row_begin.back();
        const std::uint32_t a_end = row_begin[r + 1];
        while (a < a_end && b < end) {
          if (runs[a].first <= runs[b].last + reach && runs[b].first <= runs[a].last + reach) forest.unite(a, b);
          (runs[a].last < runs[b].last) ? ++a : ++b;
        }
      };
      join(row - 1, slice);
      for (int other = row - reach; other <= row + reach; ++other) join(other, slice - 1);
    }
  }
  row_begin.push_back(static_cast<std::uint32_t>(runs.size()));

  std::vector<std::uint32_t> number(runs.size());
  for (std::uint32_t i = 0; i < runs.size(); ++i) {
    if ((i & 0xfffff) == 0 && !keep_going(1.0)) return stopped_while("looking for connected voxels");
    const std::uint32_t root = forest.root(i);
    if (root == i) number[i] = found.count++;
    runs[i].component = number[root];
  }
  return found;
}

bool any_in_run(const VoxelMask& mask, const VoxelRun& run) { return count_in_run(mask, run) > 0; }

std::int64_t count_in_run(const VoxelMask& mask, const VoxelRun& run) {
  const std::uint8_t* row = mask.values.data() + mask.index(0, run.row, run.slice);
  return std::count_if(row + run.first, row + run.last + 1, [](std::uint8_t v) { return v != 0; });
}

void fill_run(VoxelMask& mask, const VoxelRun& run, std::uint8_t value) {
  std::uint8_t* row = mask.values.data() + mask.index(0, run.row, run.slice);
  std::fill(row + run.first, row + run.last + 1, value);
}

}  // namespace osteon::imaging
