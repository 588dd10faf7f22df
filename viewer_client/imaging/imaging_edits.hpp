// What a person decides about the bones of a scan, and the same as the edit list of osteon-import.
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/volume/case_description.hpp"

namespace osteon {

enum class MedianFilter : std::uint8_t { none, slice, volume };

// What is done to the scan before its bones are found. The median comes first.
struct ScanFilter {
  MedianFilter median = MedianFilter::none;
  double gaussian_mm = 0.0;  // sigma; 0: none
  friend bool operator==(const ScanFilter&, const ScanFilter&) = default;
};

// The voxels between two opposite corners, which are centres of voxels. Only they count.
struct MarkedBox {
  Vec3 corner_mm = Vec3::Zero(), opposite_mm = Vec3::Zero();
  friend bool operator==(const MarkedBox&, const MarkedBox&) = default;
};

// A bone grows from it.
struct KeptSeed {
  Vec3 at_mm = Vec3::Zero();
  int bone = 1;  // seeds of one number are one bone; 0: outside, what grows there is no bone
  friend bool operator==(const KeptSeed&, const KeptSeed&) = default;
};

enum class CorrectionKind : std::uint8_t { paint, erase, cut };

// A change by hand of the bones that grew.
struct Correction {
  CorrectionKind kind = CorrectionKind::paint;
  int bone = 0;                      // that is painted or cut
  std::vector<Vec3> points_mm = {};  // of the stroke, or one of the plane
  double radius_mm = 0.0;            // of the stroke
  // A unit vector. Of a cut: the side that goes. Of a stroke: across the only slice that it changes; zero: all slices.
  Vec3 normal = Vec3::Zero();
};
// The states of the history own it together. Thousands of states with all points each would take gigabytes.
using SharedCorrection = std::shared_ptr<const Correction>;

// What a person says of a bone.
struct BoneLabel {
  int bone = 1;
  std::string name;
  int opacity_percent = 100;  // of its tint
  double minutes = 0.0;       // that were spent on it
  friend bool operator==(const BoneLabel&, const BoneLabel&) = default;
};

// A named point of the case.
struct MarkedLandmark {
  std::string name;
  Vec3 at_mm = Vec3::Zero();
  friend bool operator==(const MarkedLandmark&, const MarkedLandmark&) = default;
};

struct ImagingEdits {
  double threshold_hu = 226.0;  // the same default as that of osteon-import
  ScanFilter filter;
  std::optional<MarkedBox> box;
  std::vector<KeptSeed> seeds;
  std::vector<SharedCorrection> corrections;  // in their order
  std::vector<BoneLabel> labels;              // one for a bone at most
  std::vector<MarkedLandmark> landmarks;      // one of each name
  friend bool operator==(const ImagingEdits&, const ImagingEdits&) = default;
};

inline constexpr int kMostBones = 254;  // in an edit list

// What a bone is called that nobody has named.
[[nodiscard]] std::string plain_name(int bone);
// Whether osteon-import takes the name: plain text of 1 to 60 bytes, and of no other bone.
[[nodiscard]] bool may_be_called(const ImagingEdits& edits, int bone, const std::string& name);
// The lowest number that no seed or correction has, and no label that somebody has named; kMostBones if all are taken.
[[nodiscard]] int next_bone(const ImagingEdits& edits);
[[nodiscard]] const BoneLabel* label_of(const ImagingEdits& edits, int bone);
// The label of a bone, which gets one with the name "bone N" if it has none.
[[nodiscard]] BoneLabel& own_label(ImagingEdits& edits, int bone);

// Whether osteon-import takes the name for a landmark: plain text of 1 to 60 bytes.
[[nodiscard]] bool is_landmark_name(const std::string& name);
// "landmark N" with the lowest N that no landmark has.
[[nodiscard]] std::string next_landmark(const ImagingEdits& edits);
// Puts the landmark of this name at a place. Without one of the name it is a new one.
void put_landmark(ImagingEdits& edits, const std::string& name, const Vec3& at_mm);
// Gives a landmark another name. False, and nothing changes: there is none of the first name, or one of the other, or
// the other is no name of a landmark.
[[nodiscard]] bool rename_landmark(ImagingEdits& edits, const std::string& name, const std::string& other);
void remove_landmark(ImagingEdits& edits, const std::string& name);

// The options of "osteon-import ct" and "export-scan" for a filter.
[[nodiscard]] std::vector<std::string> filter_options(const ScanFilter& filter);

// The edits as a file for "osteon-import ct --edits". Positions come back bit for bit. Threshold and filter are options
// of that command, and a comment here.
[[nodiscard]] std::string edit_list_text(const ImagingEdits& edits);
// Whether that file is one that osteon-import takes: it has at most 1000 edits and 1 MiB.
[[nodiscard]] bool is_listable(const ImagingEdits& edits);

// The edits of which osteon-import makes the case. `seeds`: the seeds where they grow. Without strokes beside the scan
// and its box, and without cuts of bones that are not there.
[[nodiscard]] ImagingEdits made_edits(const ImagingEdits& edits, std::vector<KeptSeed> seeds, const ScanGeometry& scan);

}  // namespace osteon
