// Tables 5.1 to 5.3 of Niu 2008 for a scan of the user, and the active sub-volumes of a carve script, each beside
// OpenVDB's tree.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/subvolumes/active_queue.hpp"
#include "common/subvolumes/leaf_tree.hpp"
#include "common/subvolumes/quadtree.hpp"
#include "common/subvolumes/subvolume_list.hpp"
#include "server/import/carve_script.hpp"
#include "server/import/label_views.hpp"
#include "server/import/subvolume_input.hpp"

namespace osteon::import {

// A row of Table 5.1.
struct DataRow {
  std::string name;
  std::int64_t file_bytes = 0;  // as text of an SBB file; 0: has no such file
  std::int64_t voxels = 0;
  std::size_t memory_bytes = 0;  // HU and segmentation
  std::size_t triangles = 0;     // of the bone's surface
  double surface_s = 0.0;        // to reconstruct the surface
  double frame_s = 0.0;          // to draw the bone once, off-screen
  [[nodiscard]] double processing_s() const { return surface_s + frame_s; }
};

// One step of the carve script: pose after pose of a tool.
struct ActiveReport {
  std::string tool;
  std::int64_t poses = 0;
  std::vector<std::int64_t> queued;  // active sub-volumes at each pose
  subvolumes::WalkCounts walk;
  std::int64_t made = 0, emptied = 0;  // sub-volumes
  std::int64_t left = 0;               // sub-volumes after the step
  std::int64_t bone = 0;               // voxels of bone after the step
  double ms = 0.0;                     // all poses
  std::size_t memory_bytes = 0;
  // The same for the tree.
  std::vector<std::int64_t> touched;  // leaves at each pose
  subvolumes::WalkCounts leaf_walk;
  std::int64_t leaves_emptied = 0, leaves_left = 0, leaf_bone = 0;
  double leaf_ms = 0.0;
  std::size_t leaf_memory_bytes = 0;
};

struct SubVolumeMeasures {
  std::string what;  // was measured
  CoordBox object;
  std::vector<CoordBox> sections;
  std::int64_t bone = 0;  // voxels
  DataRow original, object_box, section_sum, tree;
  std::vector<subvolumes::SubdivisionCounts> subdivisions;
  // After the last subdivision, before any cut.
  std::int64_t listed = 0, listed_voxels = 0;
  std::size_t list_memory_bytes = 0, leaves = 0;
  std::vector<ActiveReport> steps;
};

struct MeasureOptions {
  int subdivisions = 3;
  double cut_mm = 1.0;  // longest way between two poses
  std::vector<CarveStep> steps;
};

// Errors: invalid_input (no bone), cancelled.
[[nodiscard]] Result<SubVolumeMeasures> measure_sub_volumes(const SubVolumeInput& input, const MeasureOptions& options,
                                                            const KeepGoing& keep_going);

// The bone of a box of the scan, as label 1, and its HU.
struct BoxVoxels {
  ScanGeometry geometry;
  std::vector<std::int16_t> hu;
  std::vector<std::uint8_t> labels;
  [[nodiscard]] LabelledVoxels view() const { return {geometry, hu, labels}; }
};
[[nodiscard]] BoxVoxels voxels_of_box(const subvolumes::BoneVoxels& voxels, const CoordBox& box);
[[nodiscard]] LabelColours bone_colours();

}  // namespace osteon::import
