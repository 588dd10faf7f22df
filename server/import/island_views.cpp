#include "server/import/island_views.hpp"

#include <algorithm>
#include <numeric>
#include <string>

#include "server/import/label_views.hpp"

namespace osteon::import {
namespace {

constexpr int kOverviewPixels = 460, kIslandPixels = 150, kBorder = 10, kGap = 8;
constexpr std::size_t kMostNumbered = 12;   // islands with a number in the overview
constexpr double kLeastInOverview = 0.001;  // of the largest island: smaller ones do not widen the overview
constexpr Colour kLeftOut{120, 122, 128};

// Around the voxel boxes of the islands that are worth a look.
Box box_of(const imaging::HuVolume& volume, const std::vector<imaging::Island>& islands) {
  Box box;
  for (const imaging::Island& island : islands) {
    if (static_cast<double>(island.voxels) < kLeastInOverview * static_cast<double>(islands.front().voxels)) continue;
    const Vec3 first(island.first[0], island.first[1], island.first[2]);
    const Vec3 last(island.last[0], island.last[1], island.last[2]);
    const Box part = imaging::enclosing_box(volume, first, last);
    box.include(part.min_mm);
    box.include(part.max_mm);
  }
  return box;
}

void write_number(Picture& picture, const Frame& frame, const Vec3& at_mm, int number) {
  const std::string text = std::to_string(number);
  const auto [x, y] = frame.pixel_of(at_mm);
  const int width = text_width(text, 2), left = static_cast<int>(x) - width / 2, top = static_cast<int>(y) - 7;
  picture.fill(left - 3, top - 3, width + 6, 20, kBlackInk);
  picture.text(left, top, text, kWhiteInk, 2);
}

}  // namespace

Result<IslandViews> draw_islands(const imaging::HuVolume& volume, const imaging::Islands& islands,
                                 std::span<const int> kept, const KeepGoing& keep_going) {
  std::vector<int> all(islands.list.size());
  std::iota(all.begin(), all.end(), 1);
  const imaging::VoxelMask numbers = imaging::number_bones(islands, all, false, volume.dims);
  LabelledVoxels voxels{
      {volume.dims, volume.origin_mm, volume.directions * volume.spacing_mm.asDiagonal()}, {}, numbers.values};
  LabelColours colours;
  for (std::size_t value = 1; value < colours.size(); ++value) colours[value] = kLeftOut;
  for (std::size_t i = 0; i < kept.size(); ++i)
    colours[static_cast<std::size_t>(std::min(kept[i], 255))] = colour_of(static_cast<int>(i));

  IslandViews views;
  const Box box = box_of(volume, islands.list);
  views.overview = Picture(2 * kOverviewPixels + kGap, kOverviewPixels + 20, kBlackInk);
  int left = 0;
  for (const View view : {View::coronal, View::sagittal}) {
    const Frame frame = frame_around(box, view, kOverviewPixels, kBorder);
    auto surface = draw_surface(voxels, colours, {}, frame, keep_going);
    if (!surface) return tl::unexpected(surface.error());
    for (std::size_t i = std::min(kMostNumbered, islands.list.size()); i-- > 0;)
      write_number(*surface, frame, islands.list[i].centre_mm, static_cast<int>(i + 1));
    views.overview.paste(*surface, left, 20);
    views.overview.text(left + 4, 2, view == View::coronal ? "from the front" : "from the left", kGreyInk, 2);
    left += kOverviewPixels + kGap;
  }

  // Each island by itself.
  for (std::size_t i = 0; i < std::min(kMostIslandsDrawn, islands.list.size()); ++i) {
    const imaging::Island& island = islands.list[i];
    LabelColours one;
    one[std::min<std::size_t>(i + 1, 255)] = colours[std::min<std::size_t>(i + 1, 255)];
    const Box around = imaging::enclosing_box(volume, Vec3(island.first[0], island.first[1], island.first[2]),
                                              Vec3(island.last[0], island.last[1], island.last[2]));
    // Only the part of the volume with the island, so that small ones are drawn at once.
    imaging::VoxelMask part_of({island.last[0] - island.first[0] + 1, island.last[1] - island.first[1] + 1,
                                island.last[2] - island.first[2] + 1});
    std::uint8_t* to = part_of.values.data();
    for (int slice = island.first[2]; slice <= island.last[2]; ++slice)
      for (int row = island.first[1]; row <= island.last[1]; ++row) {
        const std::uint8_t* from = numbers.values.data() + numbers.index(island.first[0], row, slice);
        to = std::copy(from, from + part_of.dims[0], to);
      }
    const Vec3 first(island.first[0], island.first[1], island.first[2]);
    const LabelledVoxels single{{part_of.dims, volume.position_mm(first), voxels.geometry.axes_mm}, {}, part_of.values};
    auto picture = draw_surface(single, one, {}, frame_around(around, View::coronal, kIslandPixels, 6), keep_going);
    if (!picture) return tl::unexpected(picture.error());
    views.each.push_back(std::move(*picture));
  }
  return views;
}

}  // namespace osteon::import
