// A scan at a lower resolution, for pictures in three dimensions. Each of its voxels stands for a block of the scan's.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "common/core/keep_going.hpp"
#include "viewer_client/imaging/scan_file.hpp"

namespace osteon {

// Along each axis, so a reduced scan has at most 8 MiB of HU.
inline constexpr int kMostReducedEdge = 160;

struct ScanBlocks {
  std::array<int, 3> step{1, 1, 1};  // voxels along the edges of a block
  ScanGeometry geometry;             // of the blocks' middles
};
// As small as the bound allows. Thick slices are not joined where the others' voxels are finer than they are.
[[nodiscard]] ScanBlocks blocks_of(const ScanGeometry& scan);

// Sums over the blocks of one slice of blocks; columns fastest.
class BlockSums {
 public:
  BlockSums(const ScanGeometry& scan, const ScanBlocks& blocks);

  // A slice of blocks begins.
  void begin(int slice);
  // A row of voxels of one of its slices, with one value for each column.
  template <class Value>
  void add(int row, std::span<const Value> values) {
    std::int64_t* sums = sums_.data() + static_cast<std::size_t>(row / step_[1]) * columns_;
    for (std::size_t column = 0; column < values.size(); ++column) sums[block_of_column_[column]] += values[column];
  }
  // The voxels of the slice of blocks: from the first to before the last one.
  [[nodiscard]] int first_slice() const { return first_; }
  [[nodiscard]] int last_slice() const { return last_; }
  [[nodiscard]] std::size_t size() const { return sums_.size(); }
  [[nodiscard]] std::int64_t sum(std::size_t block) const { return sums_[block]; }
  // Of the scan. The last block of an axis may have fewer than the others.
  [[nodiscard]] std::int64_t voxels(std::size_t block) const;

 private:
  std::array<int, 3> dims_, step_;
  std::size_t columns_;
  std::vector<std::size_t> block_of_column_;
  std::vector<std::int64_t> sums_;
  int first_ = 0, last_ = 0;
};

// The mean HU of each block. `keep_going` is asked before each slice of the scan. Error: cancelled.
[[nodiscard]] Result<ShownScan> reduced_scan(const ShownScan& scan, const KeepGoing& keep_going);

}  // namespace osteon
