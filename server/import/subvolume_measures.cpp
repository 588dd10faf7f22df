#include "server/import/subvolume_measures.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <tuple>
#include <utility>

#include "common/subvolumes/bounding_boxes.hpp"
#include "common/subvolumes/subvolume_file.hpp"
#include "common/subvolumes/voxel_surface.hpp"
#include "server/import/carving.hpp"

namespace osteon::import {
namespace {

using subvolumes::BoneVoxels;
using subvolumes::voxels_of;

constexpr int kFramePixels = 460, kFrameBorder = 26;  // as the pictures of an import's report

constexpr int kTimes = 3;  // that a measured work is done; the shortest time counts

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// The shortest time of some work, and what it gave the last time.
template <class Work>
auto timed(double& seconds, const KeepGoing& keep_going, Work work) -> decltype(work(keep_going)) {
  for (int time = 0;; ++time) {
    const auto begin = std::chrono::steady_clock::now();
    auto done = work(part(keep_going, static_cast<double>(time) / kTimes, static_cast<double>(time + 1) / kTimes));
    const double took_s = seconds_since(begin);
    seconds = time == 0 ? took_s : std::min(seconds, took_s);
    if (!done || time + 1 == kTimes) return done;
  }
}

// The pixels of a frame that a box may cover, as a frame of their own on the same pixels; and the first of them.
struct PartOfFrame {
  Frame frame;
  int x = 0, y = 0;
};
PartOfFrame part_of_frame(const Frame& whole, const Box& box) {
  std::array<double, 2> low{whole.pixels * 1.0, whole.pixels * 1.0}, high{0.0, 0.0};
  for (const Vec3& corner : {box.min_mm, box.max_mm}) {
    const auto pixel = whole.pixel_of(corner);
    for (std::size_t axis = 0; axis < 2; ++axis) {
      low[axis] = std::min(low[axis], pixel[axis]);
      high[axis] = std::max(high[axis], pixel[axis]);
    }
  }
  PartOfFrame part{whole, static_cast<int>(std::floor(low[0])) - 1, static_cast<int>(std::floor(low[1])) - 1};
  const double width = std::max(high[0] - part.x, high[1] - part.y);
  part.frame.pixels = static_cast<int>(std::ceil(width)) + 2;
  const double middle = 0.5 * (part.frame.pixels - 1);
  part.frame.centre_mm = whole.position_mm(part.x + middle, part.y + middle);
  return part;
}

// Draws boxes of the scan into one picture from the front, each from its own voxels. From there, no section is behind
// another one.
Result<Picture> draw_boxes(const BoneVoxels& voxels, std::span<const CoordBox> boxes, const Frame& frame,
                           const KeepGoing& keep_going) {
  Picture picture(frame.pixels, frame.pixels, kBlackInk);
  std::size_t done = 0;
  for (const CoordBox& box : boxes) {
    const auto count = static_cast<double>(boxes.size());
    const KeepGoing drawing =
        part(keep_going, static_cast<double>(done) / count, static_cast<double>(done + 1) / count);
    ++done;
    const bool whole = box == voxels.box();
    const BoxVoxels copy = whole ? BoxVoxels{} : voxels_of_box(voxels, box);
    const LabelledVoxels shown =
        whole ? LabelledVoxels{voxels.geometry, {}, voxels.bone} : LabelledVoxels{copy.geometry, {}, copy.labels};
    const LabelColours colours = bone_colours();
    const PartOfFrame place = part_of_frame(frame, coloured_box(shown, colours));
    const auto drawn = draw_surface(shown, colours, {}, place.frame, drawing);
    if (!drawn) return tl::unexpected(drawn.error());
    for (int y = 0; y < place.frame.pixels; ++y)
      for (int x = 0; x < place.frame.pixels; ++x)
        if (drawn->labels[static_cast<std::size_t>(y * place.frame.pixels + x)] != 0)
          picture.set(place.x + x, place.y + y, drawn->picture.at(x, y));
  }
  return picture;
}

// The times of a way to store the bone: to reconstruct the surface of some boxes, and to draw other boxes.
Result<void> process(const BoneVoxels& voxels, std::span<const CoordBox> cells, std::span<const CoordBox> drawn,
                     const Frame& frame, DataRow& row, const KeepGoing& keep_going) {
  const auto mesh = timed(row.surface_s, part(keep_going, 0.0, 0.5),
                          [&](const KeepGoing& going) { return subvolumes::reconstruct(voxels, cells, going); });
  if (!mesh) return tl::unexpected(mesh.error());
  row.triangles = mesh->triangles.size();
  const auto picture = timed(row.frame_s, part(keep_going, 0.5, 1.0),
                             [&](const KeepGoing& going) { return draw_boxes(voxels, drawn, frame, going); });
  if (!picture) return tl::unexpected(picture.error());
  for (const CoordBox& box : drawn) {
    row.voxels += voxels_of(box);
    row.file_bytes += subvolumes::text_bytes(voxels, box);
  }
  row.memory_bytes = static_cast<std::size_t>(row.voxels) * (sizeof(std::int16_t) + 1);
  return {};
}

// The same for the tree, which is drawn from the voxels that its leaves have.
Result<void> process_tree(const subvolumes::LeafTree& tree, const BoneVoxels& voxels, const CoordBox& object,
                          const Frame& frame, DataRow& row, const KeepGoing& keep_going) {
  const auto mesh =
      timed(row.surface_s, part(keep_going, 0.0, 0.5), [&](const KeepGoing& going) { return tree.reconstruct(going); });
  if (!mesh) return tl::unexpected(mesh.error());
  row.triangles = mesh->triangles.size();
  const auto picture = timed(row.frame_s, part(keep_going, 0.5, 1.0), [&](const KeepGoing& going) {
    BoneVoxels stored = voxels;
    const std::vector<std::uint8_t> bone = tree.bone_in(object);
    stored.geometry.dims = {object.dims().x, object.dims().y, object.dims().z};
    stored.geometry.origin_mm = voxels.geometry.position_mm(Vec3(object.min.x, object.min.y, object.min.z));
    stored.bone = bone;
    return draw_boxes(stored, std::array{stored.box()}, frame, going);
  });
  if (!picture) return tl::unexpected(picture.error());
  row.voxels = static_cast<std::int64_t>(tree.leaves()) * kLeafVoxels;
  row.memory_bytes = tree.memory_bytes();
  return {};
}

std::vector<Pose> poses_of(const CarveStep& step, double cut_mm) {
  std::vector<Pose> poses;
  for (const Cut& cut : cuts_of(step, {}, 0, cut_mm)) {
    if (poses.empty()) poses.push_back(dequantise(cut.path.front()));
    if (cut.path.size() > 1) poses.push_back(dequantise(cut.path.back()));
  }
  return poses;
}

// Cuts with one step of the script, both the sub-volumes and the tree.
Result<ActiveReport> carve(const CarveStep& step, const BoneVoxels& voxels, double cut_mm,
                           subvolumes::SubVolumeList& list, subvolumes::LeafTree& tree, const KeepGoing& keep_going) {
  ActiveReport report;
  report.tool = step.tool.name;
  subvolumes::PlacedTool tool{cut_solid(step.tool), {}};
  const std::vector<Pose> poses = poses_of(step, cut_mm);
  for (const Pose& pose : poses) {
    if (!keep_going(static_cast<double>(report.poses) / static_cast<double>(poses.size())))
      return stopped_while("carving");
    ++report.poses;
    tool.pose_bone_tool = pose;
    auto begin = std::chrono::steady_clock::now();
    const subvolumes::ActiveStep active = subvolumes::cut(list, tool, voxels.geometry);
    report.ms += 1e3 * seconds_since(begin);
    report.queued.push_back(active.queued);
    report.walk += active.walk;
    report.made += active.made;
    report.emptied += active.emptied;
    begin = std::chrono::steady_clock::now();
    const subvolumes::LeafStep leaves = tree.cut(tool);
    report.leaf_ms += 1e3 * seconds_since(begin);
    report.touched.push_back(leaves.touched);
    report.leaf_walk += leaves.walk;
    report.leaves_emptied += leaves.emptied;
  }
  report.left = static_cast<std::int64_t>(list.all().size());
  report.bone = list.bone();
  report.memory_bytes = list.memory_bytes();
  report.leaves_left = static_cast<std::int64_t>(tree.leaves());
  report.leaf_bone = tree.bone();
  report.leaf_memory_bytes = tree.memory_bytes();
  return report;
}

}  // namespace

BoxVoxels voxels_of_box(const BoneVoxels& voxels, const CoordBox& box) {
  BoxVoxels copy{.geometry = voxels.geometry, .hu = {}, .labels = {}};
  const Coord dims = box.dims();
  copy.geometry.dims = {dims.x, dims.y, dims.z};
  copy.geometry.origin_mm = voxels.geometry.position_mm(Vec3(box.min.x, box.min.y, box.min.z));
  copy.hu.reserve(copy.geometry.count());
  copy.labels.reserve(copy.geometry.count());
  for (int z = box.min.z; z <= box.max.z; ++z)
    for (int y = box.min.y; y <= box.max.y; ++y) {
      const auto first = static_cast<std::ptrdiff_t>(voxels.index({box.min.x, y, z}));
      copy.hu.insert(copy.hu.end(), voxels.hu.begin() + first, voxels.hu.begin() + first + dims.x);
      copy.labels.insert(copy.labels.end(), voxels.bone.begin() + first, voxels.bone.begin() + first + dims.x);
    }
  return copy;
}

LabelColours bone_colours() {
  LabelColours colours;
  colours[1] = Colour{222, 214, 190};
  return colours;
}

Result<SubVolumeMeasures> measure_sub_volumes(const SubVolumeInput& input, const MeasureOptions& options,
                                              const KeepGoing& keep_going) {
  const BoneVoxels voxels = input.voxels();
  SubVolumeMeasures m;
  m.what = input.what;
  const auto slices = subvolumes::slice_boxes(voxels, part(keep_going, 0.0, 0.05));
  if (!slices) return tl::unexpected(slices.error());
  m.object = subvolumes::object_box(*slices);
  if (m.object.empty()) return bad_input("the scan has no bone; give another --threshold");
  m.sections = subvolumes::section_boxes(*slices);
  m.bone = subvolumes::bone_in(voxels, m.object);

  const CoordBox whole = voxels.box();
  const Box drawn = coloured_box(voxels_of_box(voxels, m.object).view(), bone_colours());
  const Frame frame = frame_around(drawn, View::coronal, kFramePixels, kFrameBorder);
  m.original.name = "original data";
  m.object_box.name = "object box";
  m.section_sum.name = "sections, sum";
  m.tree.name = "OpenVDB tree";
  const std::vector<CoordBox> section_cells = subvolumes::cell_boxes(m.sections);
  for (const auto& [row, cells, boxes, begin, end] :
       {std::tuple{&m.original, std::vector{whole.grown(1)}, std::vector{whole}, 0.05, 0.5},
        std::tuple{&m.object_box, std::vector{m.object.grown(1)}, std::vector{m.object}, 0.5, 0.6},
        std::tuple{&m.section_sum, section_cells, m.sections, 0.6, 0.7}})
    if (auto done = process(voxels, cells, boxes, frame, *row, part(keep_going, begin, end)); !done)
      return tl::unexpected(done.error());
  auto tree = subvolumes::LeafTree::build(voxels, m.object, part(keep_going, 0.7, 0.72));
  if (!tree) return tl::unexpected(tree.error());
  if (auto done = process_tree(*tree, voxels, m.object, frame, m.tree, part(keep_going, 0.72, 0.8)); !done)
    return tl::unexpected(done.error());

  auto rows = subvolumes::count_subdivisions(voxels, m.sections, options.subdivisions, part(keep_going, 0.8, 0.82));
  if (!rows) return tl::unexpected(rows.error());
  m.subdivisions = std::move(*rows);
  auto list = subvolumes::SubVolumeList::divide(voxels, m.sections, options.subdivisions, part(keep_going, 0.82, 0.85));
  if (!list) return tl::unexpected(list.error());
  m.listed = static_cast<std::int64_t>(list->all().size());
  m.listed_voxels = list->voxels();
  m.list_memory_bytes = list->memory_bytes();
  m.leaves = tree->leaves();
  for (const CarveStep& step : options.steps) {
    const auto count = static_cast<double>(options.steps.size()), done = static_cast<double>(m.steps.size());
    auto report = carve(step, voxels, options.cut_mm, *list, *tree,
                        part(keep_going, 0.85 + 0.15 * done / count, 0.85 + 0.15 * (done + 1.0) / count));
    if (!report) return tl::unexpected(report.error());
    m.steps.push_back(std::move(*report));
  }
  return m;
}

}  // namespace osteon::import
