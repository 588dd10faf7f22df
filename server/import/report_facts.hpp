// What the report of an import says: plain facts, without anything that names a patient, a date, a file or a folder.
#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/geometry/lattice.hpp"
#include "common/volume/case_scan.hpp"
#include "server/import/ct_import.hpp"
#include "server/import/label_comparison.hpp"
#include "server/import/picture.hpp"

namespace osteon::import {

// A bone, an island that was left out, or a structure at risk.
struct ReportPart {
  int number = 0;                               // of the island or label
  std::string name;                             // empty for an island that was left out
  std::string kind;                             // as in case.json; empty for an island that was left out
  std::optional<imaging::IslandNature> island;  // what an island is, and why
  bool kept = false;                            // it is in the case
  bool at_risk = false;                         // it is no bone; no tool cuts it
  double volume_cm3 = 0.0;                      // of its voxels
  std::optional<double> density_g_cm3;          // mean; absent for what is no bone
  Vec3 centre_mm = Vec3::Zero();                // LPS
  std::string place;                            // in words
  std::optional<Colour> colour;                 // in the pictures of the case
  Picture picture;                              // empty: there is none
};

struct ReportStep {
  std::string name, text;
  std::map<std::string, double> parameters;  // names end in the unit
};

// Voxels of each range of `kBin_hu`; those below the first and above the last are counted apart.
struct HuHistogram {
  static constexpr int kFirst_hu = -1100, kBin_hu = 10, kBins = 430;
  std::vector<std::int64_t> voxels = std::vector<std::int64_t>(kBins, 0);
  std::int64_t below = 0, above = 0;

  void add(int hu, std::int64_t count);
  [[nodiscard]] std::int64_t sum() const;
};

struct ReportFacts {
  std::string title, source;
  std::optional<ScanGeometry> scan;    // that was read
  std::optional<double> threshold_hu;  // absent if bones come from labels
  // Of the case; absent if the islands were only listed.
  std::optional<double> bone_cm3, pitch_mm;
  std::string hash;
  std::optional<double> bone_density_g_cm3;  // mean over the voxels of all bone
  double metal_cm3 = 0.0, enamel_cm3 = 0.0;
  std::vector<ReportPart> parts;
  std::vector<std::string> unlisted;  // sentences: islands that are not among the parts
  std::vector<std::string> left_out;  // sentences: what, how much, why
  std::vector<std::string> warnings;
  std::vector<ReportStep> steps;
  HuHistogram of_scan, of_bone;  // of_bone is empty without a case
  bool has_hu = true;
  std::optional<LabelComparison> comparison;
};

// All that is known of an import when it ends.
struct ImportReport {
  const Case* bone = nullptr;      // absent if the islands were only listed
  const CaseScan* scan = nullptr;  // of `bone`
  const CtSegmentation* islands = nullptr;
  const PlacedLabels* labels = nullptr;      // of a label map
  const SeriesReport* series = nullptr;      // only its numbers are used
  const CtOptions* options = nullptr;        // of a CT
  std::optional<ScanGeometry> read = {};     // the whole scan
  std::string title = {}, source = {};       // if there is no case
  std::vector<std::int64_t> histogram = {};  // of imaging::hu_histogram(), of the scan as it was read; empty without HU
  const LabelComparison* comparison = nullptr;
};

// Error: cancelled.
[[nodiscard]] Result<ReportFacts> report_facts(const ImportReport& report, const KeepGoing& keep_going);

// The content of report.json.
[[nodiscard]] std::string to_json(const ReportFacts& facts);

}  // namespace osteon::import
