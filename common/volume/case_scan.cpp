#include "common/volume/case_scan.hpp"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>
#include <openvdb/tools/Prune.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <memory>
#include <new>
#include <span>
#include <string>

#include "common/core/check.hpp"
#include "common/core/freed_memory.hpp"
#include "common/geometry/lattice.hpp"
#include "common/volume/case.hpp"
#include "common/volume/openvdb_start.hpp"
#include "common/volume/vdb_size.hpp"
#include "common/volume/vdb_writer.hpp"

namespace osteon {
namespace {

using ScanGrid = openvdb::Int32Grid;
using ScanLeaf = ScanGrid::TreeType::LeafNodeType;
template <class T>
using ScanBlock = openvdb::tools::Dense<T, openvdb::tools::LayoutXYZ>;

constexpr const char *kHuGrid = "hu", *kLabelGrid = "labels", *kTissueGrid = "tissue";
constexpr std::int32_t kUsualPadding_hu = -1024;  // background: voxels that have it take no space in the file
constexpr std::uint32_t kMostScanGrids = 3;
constexpr double kReadEnd = 0.6;  // of the time to load a scan; then its hash
constexpr const char* kScanRemedy = "; import the case again";

openvdb::CoordBBox voxels_of(const ScanGeometry& geometry) {
  return {openvdb::Coord(0), openvdb::Coord(geometry.dims[0] - 1, geometry.dims[1] - 1, geometry.dims[2] - 1)};
}

// The voxels of one slice, from voxel `first` on. `copy`: memory for them, if they are not stored as bytes.
template <class T>
std::span<const std::byte> slice_bytes(const std::vector<T>& voxels, std::size_t first, std::size_t count,
                                       std::vector<std::uint8_t>&) {
  return std::as_bytes(std::span(voxels).subspan(first, count));
}
std::span<const std::byte> slice_bytes(const SparseBytes& voxels, std::size_t first, std::size_t count,
                                       std::vector<std::uint8_t>& copy) {
  copy.resize(count);
  for (std::size_t i = 0; i < count; ++i) copy[i] = voxels[first + i];
  return std::as_bytes(std::span(copy));
}

// Adds the voxels of one grid to the hash, slice by slice. False: stopped.
template <class Voxels>
bool hash_voxels(Hasher& hasher, const char* name, const Voxels& voxels, const ScanGeometry& geometry,
                 const KeepGoing& keep_going) {
  hasher.text(name);
  hasher.integer(voxels.size());
  if (voxels.empty()) return true;
  const auto slices = static_cast<std::size_t>(geometry.dims[2]), slice = voxels.size() / slices;
  std::vector<std::uint8_t> copy;
  for (std::size_t k = 0; k < slices; ++k) {
    if (keep_going && !keep_going(static_cast<double>(k) / static_cast<double>(slices))) return false;
    hasher.bytes(slice_bytes(voxels, k * slice, slice, copy));
  }
  return true;
}

// Thrown out of OpenVDB's writing if the user stops it.
struct WritingStopped {};

// A grid of the voxels of a scan that needs hardly any memory of its own. Its leaves know which voxels differ from the
// background, and get their values only while they are written, one after the other. OpenVDB 10 first compresses every
// leaf once for its size, and gives each leaf without values a buffer for that. So the grid is empty until OpenVDB asks
// for its topology.
template <class Voxels>
class ScanWriter : public ScanGrid {
 public:
  // `voxels` and `keep_going` must outlive the grid.
  ScanWriter(const char* name, const Voxels& voxels, const ScanGeometry& geometry, std::int32_t background,
             const KeepGoing& keep_going)
      : ScanGrid(background), voxels_(voxels), last_(voxels_of(geometry).max()), keep_going_(keep_going) {
    setName(name);
    setTransform(openvdb::math::Transform::createLinearTransform(1.0));
  }

  void writeTopology(std::ostream& os) const override {
    leaves_ = std::make_unique<TreeType>(background());
    for (openvdb::Int32 x = 0; x <= last_.x(); x += kLeafSize) {
      ask(kMakingEnd * x / (last_.x() + 1));
      for (openvdb::Int32 y = 0; y <= last_.y(); y += kLeafSize)
        for (openvdb::Int32 z = 0; z <= last_.z(); z += kLeafSize) add_leaf(openvdb::Coord(x, y, z));
    }
    openvdb::tools::pruneTiles(*leaves_);
    leaves_->writeTopology(os, false);
  }

  void writeBuffers(std::ostream& os) const override {
    ScanLeaf leaf;
    std::int32_t* values = leaf.buffer().data();
    std::size_t written = 0;
    const auto leaves = static_cast<double>(leaves_->leafCount());
    for (auto at = leaves_->cbeginLeaf(); at; ++at) {
      if (written++ % kOften == 0) {
        ask(kMakingEnd + (1.0 - kMakingEnd) * static_cast<double>(written) / leaves);
        give_back_freed_memory();  // compressing leaves gaps in the heap
      }
      std::fill_n(values, kLeafVoxels, background());
      each_voxel(at->origin(), [values](std::int32_t value, int place) { values[place] = value; });
      leaf.setValueMask(at->getValueMask());
      leaf.writeBuffers(os, false);
    }
    leaves_.reset();
  }

 private:
  static constexpr std::size_t kOften = 4096;  // leaves between two calls of keep_going
  static constexpr double kMakingEnd = 0.3;    // of the time

  void ask(double done) const {
    if (!keep_going_(done)) throw WritingStopped{};
  }
  // Calls `visit` with every voxel of a leaf and its place there. Columns follow each other in the scan, and slices in
  // a leaf. Returns the number of voxels: fewer at the end of the scan.
  template <class Visit>
  int each_voxel(const openvdb::Coord& origin, Visit visit) const {
    const auto count = [&](int axis) { return std::min(kLeafSize, last_[axis] + 1 - origin[axis]); };
    const int columns = count(0), rows = count(1), slices = count(2);
    for (int z = 0; z < slices; ++z)
      for (int y = 0; y < rows; ++y) {
        const std::size_t first =
            (to_index(origin.z() + z) * to_index(last_.y() + 1) + to_index(origin.y() + y)) * to_index(last_.x() + 1) +
            to_index(origin.x());
        for (int x = 0; x < columns; ++x) visit(voxels_[first + to_index(x)], (x * kLeafSize + y) * kLeafSize + z);
      }
    return columns * rows * slices;
  }
  // A leaf that knows which voxels differ from the background, but no values; a constant if all have one value.
  void add_leaf(const openvdb::Coord& origin) const {
    const std::int32_t usual = background();
    std::int32_t least = std::numeric_limits<std::int32_t>::max(), most = std::numeric_limits<std::int32_t>::min();
    std::array<openvdb::Index64, ScanLeaf::NodeMaskType::WORD_COUNT> bits{};
    const int voxels = each_voxel(origin, [&](std::int32_t value, int place) {
      least = std::min(least, value);
      most = std::max(most, value);
      bits[to_index(place / 64)] |= static_cast<openvdb::Index64>(value != usual ? 1 : 0) << (place % 64);
    });
    if (least == most && (voxels == kLeafVoxels || most == usual)) {
      if (most != usual) leaves_->addTile(1, origin, most, true);
      return;
    }
    ScanLeaf::NodeMaskType mask;
    for (openvdb::Index word = 0; word < bits.size(); ++word)
      mask.template getWord<openvdb::Index64>(word) = bits[word];
    auto leaf = std::make_unique<ScanLeaf>(openvdb::PartialCreate(), origin, usual);
    leaf->setValueMask(mask);
    leaves_->addLeaf(leaf.release());
  }

  const Voxels& voxels_;
  openvdb::Coord last_;  // voxel of the scan
  const KeepGoing& keep_going_;
  mutable std::unique_ptr<TreeType> leaves_;  // while the grid is written
};

template <class T>
void read_grid(openvdb::io::File& file, const char* name, const ScanGeometry& geometry, std::vector<T>& voxels) {
  if (!file.hasGrid(name)) return;
  const auto grid = openvdb::gridPtrCast<ScanGrid>(file.readGrid(name));
  if (!grid) OPENVDB_THROW(openvdb::TypeError, "grid \"" << name << "\" has no whole numbers");
  voxels.resize(geometry.count());
  ScanBlock<T> block(voxels_of(geometry), voxels.data());
  openvdb::tools::copyToDense(*grid, block, true);
}

// No grid has samples beyond the scan.
VdbLimits scan_limits(const std::filesystem::path& file, const ScanGeometry& geometry) {
  std::uint64_t leaves = 1;
  for (const int dim : geometry.dims) leaves *= static_cast<std::uint64_t>((dim + kLeafSize - 1) / kLeafSize);
  return {.memory_bytes = most_case_memory(file), .leaves = leaves, .grids = kMostScanGrids};
}

Result<void> check_values(std::span<const std::uint8_t> voxels, const std::vector<CaseLabel>& listed,
                          const std::string& list) {
  std::array<bool, 256> known{}, used{};
  known[0] = true;
  for (const CaseLabel& label : listed) known[static_cast<std::size_t>(label.value)] = true;
  for (const std::uint8_t value : voxels) used[value] = true;
  for (std::size_t value = 0; value < used.size(); ++value)
    if (used[value] && !known[value])
      return bad_field(list, "does not list the value " + std::to_string(value) + ", which voxels of the scan have");
  return {};
}

Result<CaseScan> read_scan_file(const std::filesystem::path& file, const ScanGeometry& geometry,
                                const KeepGoing& keep_going) try {
  start_openvdb();
  const auto stopped = [&](double done) { return keep_going && !keep_going(done); };
  CaseScan scan{.geometry = geometry};
  openvdb::io::File in(file.string());
  in.open(false);  // no delayed loading, because the file may be replaced while the program runs
  read_grid(in, kHuGrid, geometry, scan.hu);
  if (stopped(0.4)) return stopped_while("reading " + file.string());
  std::vector<std::uint8_t> labels;
  read_grid(in, kLabelGrid, geometry, labels);
  scan.labels = SparseBytes(labels);
  if (stopped(0.6)) return stopped_while("reading " + file.string());
  std::vector<std::uint8_t> tissue;
  read_grid(in, kTissueGrid, geometry, tissue);
  scan.tissue = SparseBytes(tissue);
  return scan;
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted, file.string() + " takes more memory than there is");
} catch (const std::exception& e) {
  return bad_input(file.string() + " is damaged (" + e.what() + ")" + kScanRemedy);
}

}  // namespace

Result<ScanInfo> describe_scan(const CaseScan& scan, const KeepGoing& keep_going) {
  const ScanGeometry& geometry = scan.geometry;
  const auto fits = [&](std::size_t count) { return count == 0 || count == geometry.count(); };
  OSTEON_CHECK(fits(scan.hu.size()) && fits(scan.labels.size()) && fits(scan.tissue.size()));
  const KeepGoing all = keep_going ? keep_going : [](double) { return true; };
  Hasher hasher;
  for (const int dim : geometry.dims) hasher.integer(static_cast<std::uint64_t>(dim));
  if (!hash_voxels(hasher, kHuGrid, scan.hu, geometry, part(all, 0.0, 0.5)) ||
      !hash_voxels(hasher, kLabelGrid, scan.labels, geometry, part(all, 0.5, 0.75)) ||
      !hash_voxels(hasher, kTissueGrid, scan.tissue, geometry, part(all, 0.75, 1.0)))
    return stopped_while("hashing the scan");
  return ScanInfo{hasher.finish(), geometry};
}

Result<void> check_labels_of(const CaseScan& scan, const CaseInfo& info) {
  if (Result<void> known = check_values(scan.labels.values(), info.labels, "labels"); !known) return known;
  return check_values(scan.tissue.values(), info.tissues, "tissues");
}

Result<void> save_scan(const std::filesystem::path& file, const CaseScan& scan, const KeepGoing& keep_going) try {
  start_openvdb();
  const KeepGoing all = keep_going ? keep_going : [](double) { return true; };
  const KeepGoing hu = part(all, 0.0, 0.5), labels = part(all, 0.5, 0.75), tissue = part(all, 0.75, 1.0);
  const ScanGeometry& geometry = scan.geometry;
  openvdb::GridCPtrVec grids;
  if (!scan.hu.empty())
    grids.push_back(
        std::make_shared<ScanWriter<std::vector<std::int16_t>>>(kHuGrid, scan.hu, geometry, kUsualPadding_hu, hu));
  const auto add = [&]<class Voxels>(const char* name, const Voxels& voxels, const KeepGoing& keep_going) {
    if (!voxels.empty()) grids.push_back(std::make_shared<ScanWriter<Voxels>>(name, voxels, geometry, 0, keep_going));
  };
  add(kLabelGrid, scan.labels, labels);
  add(kTissueGrid, scan.tissue, tissue);
  write_vdb(file, grids, openvdb::MetaMap());
  if (!all(1.0)) return stopped_while("writing the scan");
  return {};
} catch (const WritingStopped&) {
  return stopped_while("writing the scan");
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted, "this machine has no memory to write " + file.string());
} catch (const std::exception& e) {
  return failure(ErrorCode::internal, "cannot write " + file.string() + ": " + e.what());
}

Result<CaseScan> load_scan(const std::filesystem::path& folder, const Case& bone, const KeepGoing& keep_going) {
  const std::filesystem::path file = folder / kScanFile;
  if (!bone.info().scan)
    return failure(ErrorCode::not_found,
                   folder.string() + " has no scan; import it again from a CT or from labelled slices");
  const ScanInfo& named = *bone.info().scan;
  if (const auto size = measure_vdb(file, scan_limits(file, named.geometry), VdbValues::integers); !size) {
    Error error = size.error();
    if (error.code != ErrorCode::exhausted) error.message += kScanRemedy;
    return tl::unexpected(error);
  }
  const KeepGoing all = keep_going ? keep_going : [](double) { return true; };
  Result<CaseScan> scan = read_scan_file(file, named.geometry, part(all, 0.0, kReadEnd));
  if (!scan) return scan;
  const Result<ScanInfo> found = describe_scan(*scan, part(all, kReadEnd, 1.0));
  if (!found) return tl::unexpected(found.error());
  if (*found != named)
    return bad_input(file.string() + " is another scan than the case describes: scan.hash differs" + kScanRemedy);
  if (const Result<void> known = check_labels_of(*scan, bone.info()); !known)
    return bad_input(file.string() + ": " + known.error().message + kScanRemedy);
  return scan;
}

}  // namespace osteon
