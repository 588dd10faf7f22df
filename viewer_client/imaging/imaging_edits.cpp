#include "viewer_client/imaging/imaging_edits.hpp"

#include <algorithm>
#include <array>
#include <bitset>
#include <charconv>
#include <cmath>
#include <span>
#include <utility>

#include "common/core/bounded_text.hpp"
#include "viewer_client/imaging/corrected_plane.hpp"

namespace osteon {

namespace {

// Limits of osteon-import.
constexpr std::size_t kMostStrokePoints = 1000, kMostListedEdits = 1000, kMostListBytes = 1 << 20, kMostNameBytes = 60;

// All digits that bring it back, with a point in every locale.
std::string digits_of(double value) {
  std::array<char, 32> digits{};
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr};
}

std::string triple(const Vec3& at) {
  return "[" + digits_of(at.x()) + ", " + digits_of(at.y()) + ", " + digits_of(at.z()) + "]";
}

std::string quoted(const std::string& text) {
  std::string all = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') all += '\\';
    all += c;
  }
  return all + '"';
}

std::string entry(const std::string& kind, const std::string& fields) {
  return "  - {kind: " + kind + ", " + fields + "}\n";
}

// A stroke as edits with as many points as one may have. The next one begins where it ends.
std::vector<SharedCorrection> parts_of(const SharedCorrection& stroke) {
  if (stroke->points_mm.size() <= kMostStrokePoints) return {stroke};
  std::vector<SharedCorrection> parts;
  const std::span<const Vec3> points = stroke->points_mm;
  for (std::size_t first = 0; first + 1 < points.size(); first += kMostStrokePoints - 1) {
    const auto some = points.subspan(first, std::min(kMostStrokePoints, points.size() - first));
    parts.push_back(std::make_shared<const Correction>(
        Correction{stroke->kind, stroke->bone, {some.begin(), some.end()}, stroke->radius_mm, stroke->normal}));
  }
  return parts;
}

// An edit of a part of a stroke.
std::string stroke_text(const Correction& stroke) {
  const bool paints = stroke.kind == CorrectionKind::paint;
  const std::string bone = paints ? "bone: " + std::to_string(stroke.bone) + ", " : "";
  std::string rest = ", radius_mm: " + digits_of(stroke.radius_mm);
  if (stroke.normal != Vec3::Zero()) rest += ", normal: " + triple(stroke.normal);
  const std::vector<Vec3>& points = stroke.points_mm;
  if (points.size() == 1) return entry(paints ? "paint" : "erase", bone + "centre_mm: " + triple(points[0]) + rest);
  std::string list;
  for (const Vec3& point : points) list += (list.empty() ? "" : ", ") + triple(point);
  return entry(paints ? "scribble" : "erase", bone + "points_mm: [" + list + "]" + rest);
}

std::string correction_text(const Correction& correction) {
  if (correction.kind != CorrectionKind::cut) return stroke_text(correction);
  return entry("cut", "bone: " + std::to_string(correction.bone) + ", point_mm: " +
                          triple(correction.points_mm.front()) + ", normal: " + triple(correction.normal));
}

std::string seed_text(const KeptSeed& seed) {
  if (seed.bone == 0) return entry("outside", "point_mm: " + triple(seed.at_mm));
  return entry("seed", "point_mm: " + triple(seed.at_mm) + ", bone: " + std::to_string(seed.bone));
}

std::string label_text(const BoneLabel& label) {
  return entry("label", "bone: " + std::to_string(label.bone) + ", name: " + quoted(label.name) +
                            ", opacity: " + digits_of(label.opacity_percent / 100.0) +
                            ", minutes: " + digits_of(std::round(100.0 * label.minutes) / 100.0));
}

}  // namespace

std::string plain_name(int bone) { return "bone " + std::to_string(bone); }

int next_bone(const ImagingEdits& edits) {
  std::bitset<kMostBones + 1> taken;
  for (const KeptSeed& seed : edits.seeds) taken.set(static_cast<std::size_t>(seed.bone));
  for (const SharedCorrection& correction : edits.corrections) taken.set(static_cast<std::size_t>(correction->bone));
  for (const BoneLabel& label : edits.labels)
    if (label.name != plain_name(label.bone)) taken.set(static_cast<std::size_t>(label.bone));
  int bone = 1;
  while (bone < kMostBones && taken.test(static_cast<std::size_t>(bone))) ++bone;
  return bone;
}

const BoneLabel* label_of(const ImagingEdits& edits, int bone) {
  const auto found = std::ranges::find(edits.labels, bone, &BoneLabel::bone);
  return found != edits.labels.end() ? &*found : nullptr;
}

BoneLabel& own_label(ImagingEdits& edits, int bone) {
  const auto found = std::ranges::find(edits.labels, bone, &BoneLabel::bone);
  if (found != edits.labels.end()) return *found;
  return edits.labels.emplace_back(BoneLabel{bone, plain_name(bone), 100, 0.0});
}

std::vector<std::string> filter_options(const ScanFilter& filter) {
  std::vector<std::string> options;
  if (filter.median != MedianFilter::none)
    options.insert(options.end(), {"--median", filter.median == MedianFilter::slice ? "slice" : "volume"});
  if (filter.gaussian_mm > 0.0) options.insert(options.end(), {"--gaussian", digits_of(filter.gaussian_mm)});
  return options;
}

std::string edit_list_text(const ImagingEdits& edits) {
  std::string text = "# osteon-import ct --threshold " + digits_of(edits.threshold_hu);
  for (const std::string& option : filter_options(edits.filter)) text += " " + option;
  text += " --edits THIS_FILE\nedits:\n";
  if (edits.box)
    text +=
        entry("box", "corner_mm: " + triple(edits.box->corner_mm) + ", opposite_mm: " + triple(edits.box->opposite_mm));
  for (const KeptSeed& seed : edits.seeds) text += seed_text(seed);
  for (const SharedCorrection& correction : edits.corrections)
    for (const SharedCorrection& part : parts_of(correction)) text += correction_text(*part);
  for (const BoneLabel& label : edits.labels) text += label_text(label);
  for (const MarkedLandmark& landmark : edits.landmarks)
    text += entry("landmark", "name: " + quoted(landmark.name) + ", point_mm: " + triple(landmark.at_mm));
  return text;
}

bool is_listable(const ImagingEdits& edits) {
  const std::string text = edit_list_text(edits);
  const auto lines = static_cast<std::size_t>(std::ranges::count(text, '\n'));
  return text.size() <= kMostListBytes && lines <= kMostListedEdits + 2;  // a comment and the key come first
}

bool is_landmark_name(const std::string& name) {
  return !name.empty() && name.size() <= kMostNameBytes && bounded_text(name) == name;
}

std::string next_landmark(const ImagingEdits& edits) {
  for (int n = 1;; ++n)
    if (std::string name = "landmark " + std::to_string(n);
        std::ranges::find(edits.landmarks, name, &MarkedLandmark::name) == edits.landmarks.end())
      return name;
}

void put_landmark(ImagingEdits& edits, const std::string& name, const Vec3& at_mm) {
  const auto found = std::ranges::find(edits.landmarks, name, &MarkedLandmark::name);
  if (found == edits.landmarks.end())
    edits.landmarks.push_back({name, at_mm});
  else
    found->at_mm = at_mm;
}

bool rename_landmark(ImagingEdits& edits, const std::string& name, const std::string& other) {
  const auto found = std::ranges::find(edits.landmarks, name, &MarkedLandmark::name);
  if (found == edits.landmarks.end() || !is_landmark_name(other)) return false;
  if (other == name) return true;
  if (std::ranges::find(edits.landmarks, other, &MarkedLandmark::name) != edits.landmarks.end()) return false;
  found->name = other;
  return true;
}

void remove_landmark(ImagingEdits& edits, const std::string& name) {
  std::erase_if(edits.landmarks, [&](const MarkedLandmark& landmark) { return landmark.name == name; });
}

bool may_be_called(const ImagingEdits& edits, int bone, const std::string& name) {
  if (name.empty() || name.size() > kMostNameBytes || bounded_text(name) != name) return false;
  if (name.starts_with("bone ") && name != plain_name(bone)) return false;
  return std::ranges::none_of(edits.labels,
                              [&](const BoneLabel& label) { return label.bone != bone && label.name == name; });
}

ImagingEdits made_edits(const ImagingEdits& edits, std::vector<KeptSeed> seeds, const ScanGeometry& scan) {
  ImagingEdits made = edits;
  made.seeds = std::move(seeds);
  made.corrections.clear();
  std::bitset<kMostBones + 1> there;
  for (const KeptSeed& seed : made.seeds) there.set(static_cast<std::size_t>(seed.bone));
  const VoxelRange range = range_of(scan, edits.box);
  for (const SharedCorrection& correction : edits.corrections) {
    const auto bone = static_cast<std::size_t>(correction->bone);
    for (const SharedCorrection& part : parts_of(correction)) {
      if (part->kind == CorrectionKind::cut ? !there.test(bone) : !reaches(scan, range, *part)) continue;
      if (part->kind == CorrectionKind::paint) there.set(bone);
      made.corrections.push_back(part);
    }
  }
  return made;
}

}  // namespace osteon
