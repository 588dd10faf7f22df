#include "viewer_client/imaging/kept_slices.hpp"

#include <algorithm>
#include <fstream>
#include <system_error>

namespace osteon {

namespace {

// The plane of each slice along the voxels, so that its pixels lie as the voxels do.
PlaneAxes along_voxels(const ScanGeometry& scan) {
  PlaneAxes axes;
  axes.columns = scan.dims[0];
  axes.rows = scan.dims[1];
  axes.slices = scan.dims[2];
  return axes;
}

}  // namespace

KeptSlices::KeptSlices(const ScanGeometry& scan, const IslandMap& islands, const KeptParts& kept)
    : scan_(scan),
      islands_(islands),
      kept_(kept),
      axes_(along_voxels(scan)),
      range_(range_of(scan, kept.box)),
      voxels_(static_cast<std::size_t>(scan.dims[0]) * static_cast<std::size_t>(scan.dims[1])) {
  for (std::size_t island = 1; island < kept.bones.size(); ++island) {
    of_island_[island] = static_cast<std::uint8_t>(shown_bone(kept.bones[island]));
    bones_.set(of_island_[island]);
  }
  for (const SharedCorrection& correction : kept.corrections)
    if (correction->kind == CorrectionKind::paint) bones_.set(static_cast<std::size_t>(correction->bone));
  bones_.reset(0);
}

std::span<const std::uint8_t> KeptSlices::slice(int slice) {
  std::ranges::fill(voxels_, std::uint8_t{0});
  if (slice < range_.first[2] || slice > range_.last[2]) return voxels_;
  const auto marks = corrected_plane(scan_, islands_, kept_.bones, axes_, slice, kept_.corrections);
  for (int row = range_.first[1]; row <= range_.last[1]; ++row) {
    const std::size_t first = static_cast<std::size_t>(row) * static_cast<std::size_t>(axes_.columns);
    for (int column = range_.first[0]; column <= range_.last[0]; ++column) {
      const std::size_t at = first + static_cast<std::size_t>(column);
      const std::uint8_t mark = marks.empty() ? std::uint8_t{0} : marks[at];
      voxels_[at] = mark == 0         ? of_island_[islands_.number({column, row, slice})]
                    : mark == kErased ? std::uint8_t{0}
                                      : mark;
    }
  }
  return voxels_;
}

Result<void> write_kept(const std::filesystem::path& file, const ScanGeometry& scan, const IslandMap& islands,
                        const KeptParts& kept, const KeepGoing& keep_going) {
  KeptSlices slices(scan, islands, kept);
  const auto removed = [&](tl::unexpected<Error> error) {
    std::error_code ignored;
    std::filesystem::remove(file, ignored);
    return error;
  };
  std::ofstream out(file, std::ios::binary);
  out << number_file_header(scan);
  std::vector<char> voxels(static_cast<std::size_t>(scan.dims[0]) * static_cast<std::size_t>(scan.dims[1]));
  for (int slice = 0; slice < scan.dims[2] && out; ++slice) {
    if (!keep_going(static_cast<double>(slice) / scan.dims[2]))
      return removed(stopped_while("writing " + file.string()));
    std::ranges::transform(slices.slice(slice), voxels.begin(), [](std::uint8_t bone) { return bone == 0 ? 0 : 1; });
    out.write(voxels.data(), static_cast<std::streamsize>(voxels.size()));
  }
  out.close();
  if (!out) return removed(failure(ErrorCode::internal, "cannot write " + file.string() + "; is the disk full?"));
  return {};
}

}  // namespace osteon
