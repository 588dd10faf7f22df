// From a CT scan to a case: segmentation, resampling, surface and density.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "common/imaging/calibration.hpp"
#include "common/imaging/contrast.hpp"
#include "common/imaging/island_kinds.hpp"
#include "common/imaging/islands.hpp"
#include "common/imaging/smoothing.hpp"
#include "common/volume/case.hpp"
#include "common/volume/case_scan.hpp"
#include "common/volume/iso_surface.hpp"
#include "server/import/ct_scan.hpp"
#include "server/import/grown_bones.hpp"
#include "server/import/island_views.hpp"
#include "server/import/label_edits.hpp"
#include "server/import/placed_labels.hpp"
#include "server/import/scan_calibration.hpp"

namespace osteon::import {

// How the surface goes on from slice to slice.
enum class BetweenSlices {
  automatic,  // by shapes if imaging::has_thick_slices()
  hu,         // where the interpolated HU cross the threshold
  shapes,     // see imaging::SliceShapes
};

// Where the surface of bone lies within a segmentation.
enum class SurfaceAt {
  half_maximum,  // see imaging::move_to_half_maximum()
  threshold,     // where HU cross the threshold
};

struct CtOptions {
  std::optional<double> pitch_mm;  // absent: the scan's smallest spacing
  double threshold_hu = imaging::kBoneThreshold_hu;
  bool suggest_threshold = false;  // take suggest_threshold() instead
  GrowOptions grow;                // with seeds: the bones that grow from them are kept, instead of islands
  CalibrationOptions calibration;
  double metal_hu = imaging::kMetal_hu;  // metal is at or above it
  bool contrast_is_bone = false;         // do not look for contrast medium
  bool thin_cortex = false;              // correct the density of thin cortex, see imaging::correct_thin_cortex()
  std::string title = "CT";              // never taken from the scan, whose texts may name a patient
  std::vector<int> keep;                 // islands by number, from 1; empty: the largest that is bone
  bool keep_all = false;
  bool separate = false;  // bones that touch within the kept islands are bones of their own
  bool merge = false;     // the kept islands count as one bone
  bool hollow = false;    // cavities enclosed by bone are not bone
  // Of the bones, after all else. Seeds among them are in `grow`. A box among them counts before all else.
  std::vector<LabelEdit> edits;
  std::string edits_file;       // their name, for errors
  bool list_only = false;       // find the islands and make no case
  bool draw_islands = false;    // for a report
  bool number_islands = false;  // with list_only: CtImport::scan gets their numbers
  // Taken out of the scan before anything else: outliers by a median, then noise by a Gaussian.
  std::optional<imaging::MedianBox> median;
  double gaussian_mm = 0.0;  // its sigma; 0: none
  SurfaceAt surface = SurfaceAt::half_maximum;
  BetweenSlices between_slices = BetweenSlices::automatic;
  // The case keeps the scan this far around its bones. It has the HU after the filters.
  double margin_mm = 10.0;
};

// A bone that was separated from others, or that edits may have changed.
struct FoundBone {
  int number = 0;
  double volume_cm3 = 0.0;         // of its voxels
  bool segmented = true;           // otherwise edits made it
  std::vector<std::string> edits;  // that name or changed it
};

// Result of the segmentation.
struct CtSegmentation {
  double threshold_hu = 0.0;                   // that was used
  std::string threshold_reason;                // empty if the threshold was not suggested
  std::vector<imaging::Region> regions;        // that grew from seeds
  std::vector<imaging::Island> islands;        // largest first; number N is islands[N - 1]
  std::vector<imaging::IslandNature> natures;  // of each island; empty if the bones grew from seeds
  std::optional<imaging::BloodPool> contrast;  // if the scan has contrast medium
  std::vector<int> kept;                       // numbers; empty if the islands were only listed
  bool merged = false;                         // the kept islands are one bone
  bool separated = false;
  std::vector<FoundBone> bones;    // only if they were separated or edited; otherwise each kept island is one
  std::vector<std::string> edits;  // what each edit did, for a person
  double left_out_cm3 = 0.0;       // of the islands that were not kept
  double marrow_cm3 = 0.0;         // below the threshold, within the kept islands
  double blur_cm3 = 0.0;           // between the threshold and the level of the surface, within the kept islands
  std::vector<double> joined_cm3;  // parts of dense and cancellous bone that only marrow joins, if several are large
  double case_cm3 = 0.0;           // of the case's bone
  double metal_cm3 = 0.0, enamel_cm3 = 0.0;  // within the kept islands
  double metal_hu = imaging::kMetal_hu;
  Box region;         // part of the scan around everything that reaches the threshold, LPS. With seeds: the whole scan
  IslandViews views;  // empty unless the options ask for them
};

struct CtImport {
  CtSegmentation found;
  std::optional<Case> bone;           // empty only if the islands were only listed
  CaseScan scan;                      // of `bone`; of islands that were numbered, where they lie, and their numbers
  std::string calibration_text = {};  // see ScanCalibration
  PlacedLabels labels = {};           // of a label map, without their voxels
};

// segment_bone() decides what is bone, and the options decide which islands are kept. With seeds, the grown regions
// take the place of the voxels at or above the threshold. Then the surface moves to its level. Edits come last. If the
// scan ends within bone, the bone ends with the last whole voxel. No density is above that of compact bone; denser
// parts of the scan are labelled metal or enamel. Errors: invalid_input (no bone, no such island, an edit that cannot
// be replayed, voxels of an impossible size, too many samples), exhausted (memory), cancelled, internal.
[[nodiscard]] Result<CtImport> import_ct(CtScan scan, const CtOptions& options, const KeepGoing& keep_going);

// The same with the labels of a label map, which place_labels() has put on the scan's voxels: bones become the case's
// bone, each with the number of its label, and their surface is that of the labels, smoothed. All labels become those
// of the case's scan, which reaches `margin_mm` beyond them. Density comes from the HU, and metal and enamel too where
// no label says what the tissue is. Of the options, those of segmentation do not matter. Errors as above.
[[nodiscard]] Result<CtImport> import_ct(CtScan scan, PlacedLabels labels, const CtOptions& options,
                                         const KeepGoing& keep_going);

// The position of a point within a box, as a patient's sides: LPS. "middle" if it is in the middle third of all axes.
[[nodiscard]] std::string place_words(const Vec3& at, const Box& box);
// The kind of an island for a person, such as "table or headrest".
[[nodiscard]] std::string words_of(imaging::IslandKind kind);
// Why an island is of a kind that is no bone, such as "its shape is that of a table or headrest".
[[nodiscard]] std::string likeness_of(imaging::IslandKind kind);

// Islands of one kind that are not bone.
struct NotBone {
  imaging::IslandKind kind = imaging::IslandKind::table;
  bool kept = false;              // because somebody named them
  std::vector<int> islands = {};  // by number
  double volume_cm3 = 0.0;
  std::string text = {};  // for a person: what, which, how much and why
};
// By kind; those that are kept after the others of their kind.
[[nodiscard]] std::vector<NotBone> not_bone(const CtSegmentation& found);

// What each edit did, as lines for a person.
[[nodiscard]] std::string edits_text(const CtSegmentation& found);

// The islands, the volume left out, and metal, as lines for a person.
[[nodiscard]] std::string segmentation_text(const CtSegmentation& found);

}  // namespace osteon::import
