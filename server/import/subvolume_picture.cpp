// The picture of the boxes on the bone. Bone and planes are drawn as those of an import's report.
#include <algorithm>
#include <cmath>

#include "server/import/subvolume_report.hpp"

namespace osteon::import {
namespace {

constexpr int kBoxPanel = 460, kBoxEdge = 26, kBoxCaption = 22, kBoxSpace = 8;  // pixels
constexpr Colour kFullInk{0, 158, 115}, kPartlyInk{240, 228, 66};               // of Okabe 2008

// The edges of a box of voxels, as far as its outer faces.
void draw_box(Picture& picture, const Frame& frame, const ScanGeometry& geometry, const CoordBox& box, Colour colour) {
  std::array<std::array<double, 2>, 8> corners{};
  for (std::size_t corner = 0; corner < 8; ++corner)
    corners[corner] = frame.pixel_of(geometry.position_mm(Vec3((corner & 1) != 0 ? box.max.x + 0.5 : box.min.x - 0.5,
                                                               (corner & 2) != 0 ? box.max.y + 0.5 : box.min.y - 0.5,
                                                               (corner & 4) != 0 ? box.max.z + 0.5 : box.min.z - 0.5)));
  for (std::size_t from = 0; from < 8; ++from)
    for (const std::size_t axis : {1, 2, 4}) {
      if ((from & axis) != 0) continue;
      const auto &a = corners[from], &b = corners[from | axis];
      const int steps = 1 + static_cast<int>(std::max(std::abs(b[0] - a[0]), std::abs(b[1] - a[1])));
      for (int step = 0; step <= steps; ++step) {
        const double t = static_cast<double>(step) / steps;
        picture.set(static_cast<int>(std::lround(a[0] + t * (b[0] - a[0]))),
                    static_cast<int>(std::lround(a[1] + t * (b[1] - a[1]))), colour);
      }
    }
}

// The bone seen from a side, with the object box and the sections.
Result<Picture> side_panel(const BoxVoxels& object, View view, const ScanGeometry& geometry,
                           const SubVolumeMeasures& measures, const KeepGoing& keep_going) {
  const LabelColours colours = bone_colours();
  const Frame frame = frame_around(coloured_box(object.view(), colours), view, kBoxPanel, kBoxEdge);
  auto drawn = draw_surface(object.view(), colours, {}, frame, keep_going);
  if (!drawn) return tl::unexpected(drawn.error());
  for (std::size_t i = 0; i < measures.sections.size(); ++i)
    draw_box(drawn->picture, frame, geometry, measures.sections[i], palette_colour(static_cast<int>(i)));
  draw_box(drawn->picture, frame, geometry, measures.object, kWhiteInk);
  write_sides(drawn->picture, frame);
  return std::move(drawn->picture);
}

// The middle of a section with its quadrants. Empty ones have no outline.
Result<Picture> section_panel(const SubVolumeInput& input, const CoordBox& section, int subdivisions,
                              const KeepGoing& keep_going) {
  const subvolumes::BoneVoxels voxels = input.voxels();
  const auto list = subvolumes::SubVolumeList::divide(voxels, std::array{section}, subdivisions, keep_going);
  if (!list) return tl::unexpected(list.error());
  const BoxVoxels copy = voxels_of_box(voxels, subvolumes::common_box(section.grown(4), voxels.box()));
  Box box;
  for (const Coord& corner : {section.min, section.max})
    box.include(voxels.geometry.position_mm(Vec3(corner.x, corner.y, corner.z)));
  const Frame frame = frame_around(box, View::axial, kBoxPanel, kBoxEdge);
  Picture picture = draw_plane(copy.view(), {}, frame);
  for (const subvolumes::SubVolume& part_of_section : list->all())
    draw_box(picture, frame, voxels.geometry, part_of_section.box,
             part_of_section.fill == subvolumes::Fill::full ? kFullInk : kPartlyInk);
  write_sides(picture, frame);
  return picture;
}

}  // namespace

Result<Picture> boxes_picture(const SubVolumeInput& input, const SubVolumeMeasures& measures,
                              const KeepGoing& keep_going) {
  const BoxVoxels object = voxels_of_box(input.voxels(), measures.object);
  Picture whole(3 * kBoxPanel + 2 * kBoxSpace, kBoxPanel + kBoxCaption, Colour{40, 44, 50});
  const auto place = [&](const Picture& panel, const std::string& caption, int column) {
    const int x = column * (kBoxPanel + kBoxSpace);
    whole.fill(x, 0, kBoxPanel, kBoxCaption, kBlackInk);
    whole.text(x + 6, 4, caption, kWhiteInk, 2);
    whole.paste(panel, x, kBoxCaption);
  };
  auto front = side_panel(object, View::coronal, input.geometry, measures, part(keep_going, 0.0, 0.45));
  if (!front) return front;
  place(*front, "from the front", 0);
  auto left = side_panel(object, View::sagittal, input.geometry, measures, part(keep_going, 0.45, 0.9));
  if (!left) return left;
  place(*left, "from the left", 1);
  const auto highest =
      std::ranges::max_element(measures.sections, {}, [](const CoordBox& section) { return section.dims().z; });
  auto section =
      section_panel(input, *highest, static_cast<int>(measures.subdivisions.size()) - 1, part(keep_going, 0.9, 1.0));
  if (!section) return section;
  place(*section, "section " + std::to_string(highest - measures.sections.begin() + 1) + ": full, partly full", 2);
  return whole;
}

}  // namespace osteon::import
