#include "server/import/island_views.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>

#include "server/import/label_views.hpp"

namespace osteon::import {
namespace {

constexpr int kOverviewPixels = 460, kIslandPixels = 150, kBorder = 28, kGap = 8;
constexpr std::size_t kMostNumbered = 24;   // islands with a number in the overview
constexpr std::size_t kLeastSeen = 30;      // pixels of an island with a number
constexpr double kLeastInOverview = 0.001;  // of the largest island: smaller ones do not widen the overview
constexpr Colour kLeftOutInk{120, 122, 128};

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

// Writes numbers of islands where one sees them, the largest first. A number for which there is no room is left out.
void write_numbers(SurfacePicture& surface, std::size_t count) {
  const int size = surface.picture.width();
  std::vector<std::array<int, 4>> taken;  // left, top, right, bottom
  for (std::size_t island = 0; island < count; ++island) {
    // The pixel of the island that is nearest to the middle of all its pixels.
    std::vector<std::array<int, 2>> seen;
    double sum_x = 0.0, sum_y = 0.0;
    for (int y = 0, i = 0; y < size; ++y)
      for (int x = 0; x < size; ++x, ++i) {
        if (surface.labels[static_cast<std::size_t>(i)] != island + 1) continue;
        seen.push_back({x, y});
        sum_x += x;
        sum_y += y;
      }
    if (seen.size() < kLeastSeen) continue;
    const double middle_x = sum_x / static_cast<double>(seen.size());
    const double middle_y = sum_y / static_cast<double>(seen.size());
    const auto at = *std::ranges::min_element(
        seen, {}, [&](const auto& pixel) { return std::hypot(pixel[0] - middle_x, pixel[1] - middle_y); });
    const std::string text = std::to_string(island + 1);
    const int width = text_width(text, 2), left = at[0] - width / 2, top = at[1] - 7;
    const std::array<int, 4> room{left - 3, top - 3, left + width + 3, top + 17};
    const bool free = std::ranges::none_of(taken, [&](const auto& other) {
      return room[0] < other[2] && other[0] < room[2] && room[1] < other[3] && other[1] < room[3];
    });
    if (!free) continue;
    taken.push_back(room);
    surface.picture.fill(room[0], room[1], room[2] - room[0], room[3] - room[1], kBlackInk);
    surface.picture.text(left, top, text, kWhiteInk, 2);
  }
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
  for (std::size_t value = 1; value < colours.size(); ++value) colours[value] = kLeftOutInk;
  for (std::size_t i = 0; i < kept.size(); ++i)
    colours[static_cast<std::size_t>(std::min(kept[i], 255))] = palette_colour(static_cast<int>(i));

  IslandViews views;
  const Box box = box_of(volume, islands.list);
  views.overview = Picture(2 * kOverviewPixels + kGap, kOverviewPixels + 20, kBlackInk);
  int left = 0;
  for (const View view : {View::coronal, View::sagittal}) {
    const Frame frame = frame_around(box, view, kOverviewPixels, kBorder);
    auto surface = draw_surface(voxels, colours, {}, frame, keep_going);
    if (!surface) return tl::unexpected(surface.error());
    write_numbers(*surface, std::min(kMostNumbered, islands.list.size()));
    write_sides(surface->picture, frame);
    views.overview.paste(surface->picture, left, 20);
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
    views.each.push_back(std::move(picture->picture));
  }
  return views;
}

}  // namespace osteon::import
