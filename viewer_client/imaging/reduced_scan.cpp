#include "viewer_client/imaging/reduced_scan.hpp"

#include <algorithm>
#include <cmath>

namespace osteon {

namespace {

constexpr double kSameStep = 1e-9;  // of a step, for quotients that are whole numbers but for rounding

int blocks_along(int voxels, int step) { return (voxels + step - 1) / step; }

}  // namespace

ScanBlocks blocks_of(const ScanGeometry& scan) {
  const Vec3 edge_mm = scan.axes_mm.colwise().norm();
  double longest_mm = 0.0;
  for (int axis = 0; axis < 3; ++axis)
    longest_mm = std::max(longest_mm, scan.dims[static_cast<std::size_t>(axis)] * edge_mm[axis]);
  const double wanted_mm = longest_mm / kMostReducedEdge;
  ScanBlocks blocks;
  Vec3 middle;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    int& step = blocks.step[a];
    step = std::max(1, static_cast<int>(std::ceil(wanted_mm / edge_mm[axis] - kSameStep)));
    while (blocks_along(scan.dims[a], step) > kMostReducedEdge) ++step;
    blocks.geometry.dims[a] = blocks_along(scan.dims[a], step);
    blocks.geometry.axes_mm.col(axis) = step * scan.axes_mm.col(axis);
    middle[axis] = 0.5 * (step - 1);
  }
  blocks.geometry.origin_mm = scan.position_mm(middle);
  return blocks;
}

BlockSums::BlockSums(const ScanGeometry& scan, const ScanBlocks& blocks)
    : dims_(scan.dims),
      step_(blocks.step),
      columns_(static_cast<std::size_t>(blocks.geometry.dims[0])),
      sums_(columns_ * static_cast<std::size_t>(blocks.geometry.dims[1])) {
  block_of_column_.reserve(static_cast<std::size_t>(dims_[0]));
  for (int column = 0; column < dims_[0]; ++column)
    block_of_column_.push_back(static_cast<std::size_t>(column / step_[0]));
}

void BlockSums::begin(int slice) {
  std::ranges::fill(sums_, 0);
  first_ = slice * step_[2];
  last_ = std::min(dims_[2], first_ + step_[2]);
}

std::int64_t BlockSums::voxels(std::size_t block) const {
  const auto along = [](int voxels, int step, std::size_t at) {
    return std::min(step, voxels - static_cast<int>(at) * step);
  };
  return std::int64_t{along(dims_[0], step_[0], block % columns_)} * along(dims_[1], step_[1], block / columns_) *
         (last_ - first_);
}

Result<ShownScan> reduced_scan(const ShownScan& scan, const KeepGoing& keep_going) {
  const ScanBlocks blocks = blocks_of(scan.geometry);
  const auto [columns, rows, slices] = scan.geometry.dims;
  BlockSums sums(scan.geometry, blocks);
  ShownScan reduced{blocks.geometry, {}};
  reduced.values.reserve(blocks.geometry.count());
  for (int block = 0; block < blocks.geometry.dims[2]; ++block) {
    sums.begin(block);
    for (int slice = sums.first_slice(); slice < sums.last_slice(); ++slice) {
      if (!keep_going(static_cast<double>(slice) / slices)) return stopped_while("reducing the scan");
      for (int row = 0; row < rows; ++row)
        sums.add(row, std::span(scan.values).subspan(scan.index({0, row, slice}), static_cast<std::size_t>(columns)));
    }
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const double mean = static_cast<double>(sums.sum(i)) / static_cast<double>(sums.voxels(i));
      reduced.values.push_back(static_cast<std::int16_t>(std::lround(mean)));
    }
  }
  return reduced;
}

}  // namespace osteon
