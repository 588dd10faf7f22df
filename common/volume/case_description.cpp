#include "common/volume/case_description.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <span>

#include "common/core/bounded_text.hpp"

namespace osteon {
namespace {

using nlohmann::json;

constexpr std::uintmax_t kMostInfoBytes = 1 << 20;
constexpr std::size_t kMostLabels = 255, kMostParameters = 1000, kMostEdits = 1000;
constexpr int kLargestScanDim = 1 << 14;
constexpr double kMostScanVoxels = 1 << 29;
constexpr double kFarthest_mm = 1e5, kLeastStep_mm = 1e-3, kMostStep_mm = 1e3;
constexpr double kUnitError = 1e-6;
// Least volume of a voxel as a part of the cuboid with the same edges. Below it, the axes lie in a plane.
constexpr double kLeastSkew = 0.01;
constexpr std::size_t kMostQuoted = 60;  // bytes of a value in an error
constexpr const char* kScanFrame = "LPS";
constexpr std::array<std::string_view, 10> kKindNames{"bone",      "cortical", "cancellous", "metal", "enamel",
                                                      "cartilage", "nerve",    "vessel",     "dura",  "soft_tissue"};

// A fault of a description. Thrown during the check or the reading of one, and caught in this file.
struct Fault {
  std::string what;
};
[[noreturn]] void fault(const std::string& field, const std::string& what) { throw Fault{field + " " + what}; }

std::string kinds_text() {
  std::string text;
  for (const std::string_view name : kKindNames) text += (text.empty() ? "" : ", ") + std::string(name);
  return text;
}

std::string item(const std::string& list, std::size_t i) { return list + "[" + std::to_string(i) + "]"; }

// ---- What a description must fulfil.

void check_text(const std::string& field, const std::string& text) {
  if (text.empty()) fault(field, "is empty");
  if (text.size() > kMostCaseTextBytes) fault(field, "is longer than " + std::to_string(kMostCaseTextBytes) + " bytes");
  if (std::ranges::any_of(text, [](unsigned char c) { return c < 0x20 || c == 0x7f; }))
    fault(field, "has control characters");
}

void check_point(const std::string& field, const Vec3& point_mm) {
  for (const double c : point_mm)
    if (!(std::abs(c) <= kFarthest_mm)) fault(field, "is not three numbers within 100 m");
}

void check_unit(const std::string& field, const Vec3& vector) {
  if (!(std::abs(vector.norm() - 1.0) <= kUnitError)) fault(field, "is not a unit vector");
}

void check_count(const std::string& list, std::size_t count, std::size_t most) {
  if (count > most) fault(list, "has more than " + std::to_string(most) + " entries");
}

// Names of a list are texts, each of them once.
template <class Entry>
void check_names(const std::string& list, const std::vector<Entry>& entries) {
  std::set<std::string_view> seen;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const std::string field = item(list, i) + ".name";
    check_text(field, entries[i].name);
    if (!seen.insert(entries[i].name).second) fault(field, "\"" + entries[i].name + "\" occurs twice");
  }
}

void check_provenance(const std::string& field, const LabelProvenance& provenance) {
  check_text(field + ".method", provenance.method);
  check_count(field + ".parameters", provenance.parameters.size(), kMostParameters);
  const std::string parameters = field + ".parameters";
  for (const auto& [name, value] : provenance.parameters) {
    check_text(parameters, name);
    if (!std::isfinite(value)) fault((parameters + ".").append(name), "is not a finite number");
  }
  check_count(field + ".edits", provenance.edits.size(), kMostEdits);
  for (std::size_t i = 0; i < provenance.edits.size(); ++i) check_text(item(field + ".edits", i), provenance.edits[i]);
}

void check_labels(const std::string& list, const std::vector<CaseLabel>& labels) {
  check_count(list, labels.size(), kMostLabels);
  check_names(list, labels);
  std::set<int> seen;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const std::string field = item(list, i);
    if (labels[i].value < 1 || labels[i].value > 255) fault(field + ".value", "is not a number from 1 to 255");
    if (!seen.insert(labels[i].value).second)
      fault(field + ".value", std::to_string(labels[i].value) + " occurs twice");
    if (static_cast<std::size_t>(labels[i].kind) >= kKindNames.size()) fault(field + ".kind", "is unknown");
    check_provenance(field + ".provenance", labels[i].provenance);
  }
}

void check_scan(const ScanGeometry& geometry) {
  double voxels = 1.0;
  for (const int dim : geometry.dims) {
    if (dim < 1 || dim > kLargestScanDim)
      fault("scan.dims", "has a number that is not from 1 to " + std::to_string(kLargestScanDim));
    voxels *= dim;
  }
  if (voxels > kMostScanVoxels) fault("scan.dims", "has more than 2^29 voxels");
  check_point("scan.origin_mm", geometry.origin_mm);
  double edges_mm3 = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double step_mm = geometry.axes_mm.col(axis).norm();
    if (!(step_mm >= kLeastStep_mm && step_mm <= kMostStep_mm))
      fault(item("scan.axes_mm", static_cast<std::size_t>(axis)), "is not a step of 0.001 to 1000 mm");
    edges_mm3 *= step_mm;
  }
  if (!(std::abs(geometry.axes_mm.determinant()) >= kLeastSkew * edges_mm3))
    fault("scan.axes_mm", "has three steps in one plane");
}

void check_regions(const std::vector<PlannedRegion>& regions, const std::vector<CaseLabel>& labels) {
  check_count("regions", regions.size(), kMostCaseEntries);
  check_names("regions", regions);
  for (std::size_t i = 0; i < regions.size(); ++i) {
    const PlannedRegion& region = regions[i];
    if (region.label != 0) {
      if (std::ranges::find(labels, region.label, &CaseLabel::value) == labels.end())
        fault(item("regions", i) + ".label", "is " + std::to_string(region.label) + ", which labels does not list");
      continue;
    }
    check_point(item("regions", i) + ".min_mm", region.min_mm);
    check_point(item("regions", i) + ".max_mm", region.max_mm);
    if (!(region.min_mm.array() < region.max_mm.array()).all())
      fault(item("regions", i) + ".min_mm", "is not below max_mm on every axis");
  }
}

void check_plan(const CaseInfo& info) {
  check_count("landmarks", info.landmarks.size(), kMostCaseEntries);
  check_names("landmarks", info.landmarks);
  for (std::size_t i = 0; i < info.landmarks.size(); ++i)
    check_point(item("landmarks", i) + ".point_mm", info.landmarks[i].point_mm);
  check_count("axes", info.axes.size(), kMostCaseEntries);
  check_names("axes", info.axes);
  for (std::size_t i = 0; i < info.axes.size(); ++i) {
    check_point(item("axes", i) + ".point_mm", info.axes[i].point_mm);
    check_unit(item("axes", i) + ".direction", info.axes[i].direction);
  }
  check_count("planes", info.planes.size(), kMostCaseEntries);
  check_names("planes", info.planes);
  for (std::size_t i = 0; i < info.planes.size(); ++i) {
    check_point(item("planes", i) + ".point_mm", info.planes[i].point_mm);
    check_unit(item("planes", i) + ".normal", info.planes[i].normal);
  }
  check_regions(info.regions, info.labels);
}

void check_numbers(const CaseInfo& info) {
  if (!(info.pitch_mm > 0.0) || !std::isfinite(info.pitch_mm)) fault("pitch_mm", "must be above zero");
  if (!std::isfinite(info.threshold_hu)) fault("threshold_hu", "is not a finite number");
  if (!std::isfinite(info.calibration.slope_g_cm3_per_hu) || !std::isfinite(info.calibration.intercept_g_cm3))
    fault("calibration", "has a number that is not finite");
  if (info.density_from) check_provenance("calibration.provenance", *info.density_from);
}

// What only version 2 has.
bool has_more_than_version_1(const CaseInfo& info) {
  return info.density_from || info.scan || !info.labels.empty() || !info.tissues.empty() || !info.landmarks.empty() ||
         !info.axes.empty() || !info.planes.empty() || !info.regions.empty();
}

// ---- Writing.

json list_of(const Vec3& v) { return json::array({v.x(), v.y(), v.z()}); }

template <class Entry, class ToJson>
json list_of(const std::vector<Entry>& entries, ToJson to_json) {
  json list = json::array();
  for (const Entry& entry : entries) list.push_back(to_json(entry));
  return list;
}

json provenance_json(const LabelProvenance& provenance) {
  json parameters = json::object();
  for (const auto& [name, value] : provenance.parameters) parameters[name] = value;
  return {{"method", provenance.method}, {"parameters", std::move(parameters)}, {"edits", json(provenance.edits)}};
}

json label_json(const CaseLabel& label) {
  return {{"value", label.value},
          {"name", label.name},
          {"kind", name_of(label.kind)},
          {"provenance", provenance_json(label.provenance)}};
}

json region_json(const PlannedRegion& region) {
  if (region.label != 0) return {{"name", region.name}, {"label", region.label}};
  return {{"name", region.name}, {"min_mm", list_of(region.min_mm)}, {"max_mm", list_of(region.max_mm)}};
}

json scan_json(const ScanInfo& scan) {
  json axes = json::array();
  for (int axis = 0; axis < 3; ++axis) axes.push_back(list_of(scan.geometry.axes_mm.col(axis)));
  return {{"hash", to_hex(scan.hash)},
          {"frame", kScanFrame},
          {"dims", json(scan.geometry.dims)},
          {"origin_mm", list_of(scan.geometry.origin_mm)},
          {"axes_mm", std::move(axes)}};
}

// ---- Reading.

// A value of the file with its name, such as "labels[3].kind". Each function throws a Fault that names it.
class Field {
 public:
  Field(const json& value, std::string name) : value_(value), name_(std::move(name)) {}

  [[noreturn]] void refuse(const std::string& what) const { fault(name_, what); }
  [[nodiscard]] bool has(const char* key) const { return object().contains(key); }
  [[nodiscard]] Field at(const char* key) const {
    const std::string name = name_.empty() ? key : name_ + "." + key;
    if (!has(key)) fault(name, "is missing");
    return {value_.at(key), name};
  }
  [[nodiscard]] std::vector<Field> list(std::size_t most) const {
    if (!value_.is_array()) fault(name_, "is not a list");
    check_count(name_, value_.size(), most);
    std::vector<Field> fields;
    for (const json& entry : value_) fields.emplace_back(entry, item(name_, fields.size()));
    return fields;
  }
  [[nodiscard]] std::map<std::string, double> numbers() const {
    check_count(name_, object().size(), kMostParameters);
    std::map<std::string, double> numbers;
    for (const auto& [key, number] : value_.items())
      numbers[key] = Field(number, name_ + "." + bounded_text(key, kMostQuoted)).number();
    return numbers;
  }
  [[nodiscard]] std::string text() const {
    if (!value_.is_string()) fault(name_, "is not a text");
    return value_.get<std::string>();
  }
  [[nodiscard]] double number() const {
    if (!value_.is_number()) fault(name_, "is not a number");
    return value_.get<double>();
  }
  // The whole numbers of a description are small. Others become one that the check refuses.
  [[nodiscard]] int integer() const {
    if (!value_.is_number_integer()) fault(name_, "is not a whole number");
    return value_.is_number_unsigned() && value_.get<std::uint64_t>() < kLargestInteger
               ? static_cast<int>(value_.get<std::uint64_t>())
               : -1;
  }
  [[nodiscard]] Vec3 vec3() const {
    const std::vector<Field> parts = three();
    return {parts[0].number(), parts[1].number(), parts[2].number()};
  }
  [[nodiscard]] std::vector<Field> three() const {
    std::vector<Field> parts = list(3);
    if (parts.size() != 3) fault(name_, "does not have three entries");
    return parts;
  }
  [[nodiscard]] Digest digest() const {
    const Result<Digest> hash = digest_from_hex(text());
    if (!hash) fault(name_, "is not a hash: " + bounded_text(hash.error().message, kMostQuoted));
    return *hash;
  }
  [[nodiscard]] LabelKind kind() const {
    const std::string word = text();
    const auto found = std::ranges::find(kKindNames, word);
    if (found == kKindNames.end())
      fault(name_, "is \"" + bounded_text(word, kMostQuoted) + "\", which is none of " + kinds_text());
    return static_cast<LabelKind>(found - kKindNames.begin());
  }

 private:
  static constexpr std::uint64_t kLargestInteger = 1 << 30;
  [[nodiscard]] const json& object() const {
    if (!value_.is_object()) fault(name_.empty() ? "it" : name_, "is not an object");
    return value_;
  }
  const json& value_;
  std::string name_;
};

LabelProvenance read_provenance(const Field& field) {
  LabelProvenance provenance;
  provenance.method = field.at("method").text();
  provenance.parameters = field.at("parameters").numbers();
  for (const Field& edit : field.at("edits").list(kMostEdits)) provenance.edits.push_back(edit.text());
  return provenance;
}

CaseLabel read_label(const Field& field) {
  return {.value = field.at("value").integer(),
          .name = field.at("name").text(),
          .kind = field.at("kind").kind(),
          .provenance = read_provenance(field.at("provenance"))};
}

PlannedRegion read_region(const Field& field) {
  PlannedRegion region{.name = field.at("name").text()};
  if (!field.has("label")) {
    region.min_mm = field.at("min_mm").vec3();
    region.max_mm = field.at("max_mm").vec3();
    return region;
  }
  region.label = field.at("label").integer();
  if (region.label == 0) field.at("label").refuse("is 0, which is no label");
  return region;
}

ScanInfo read_scan(const Field& field) {
  ScanInfo scan;
  scan.hash = field.at("hash").digest();
  if (field.at("frame").text() != kScanFrame) fault("scan.frame", std::string("is not ") + kScanFrame);
  const std::vector<Field> dims = field.at("dims").three(), axes = field.at("axes_mm").three();
  scan.geometry.origin_mm = field.at("origin_mm").vec3();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    scan.geometry.dims[axis] = dims[axis].integer();
    scan.geometry.axes_mm.col(static_cast<int>(axis)) = axes[axis].vec3();
  }
  return scan;
}

// Fields that are missing are empty.
template <class Entry, class Read>
void read_list(const Field& root, const char* key, std::vector<Entry>& to, Read read) {
  if (!root.has(key)) return;
  for (const Field& field : root.at(key).list(kMostCaseEntries)) to.push_back(read(field));
}

void read_version_2(const Field& root, CaseInfo& info) {
  if (root.at("calibration").has("provenance"))
    info.density_from = read_provenance(root.at("calibration").at("provenance"));
  if (root.has("scan")) info.scan = read_scan(root.at("scan"));
  read_list(root, "labels", info.labels, read_label);
  read_list(root, "tissues", info.tissues, read_label);
  read_list(root, "landmarks", info.landmarks, [](const Field& f) {
    return Landmark{f.at("name").text(), f.at("point_mm").vec3()};
  });
  read_list(root, "axes", info.axes, [](const Field& f) {
    return PlannedAxis{f.at("name").text(), f.at("point_mm").vec3(), f.at("direction").vec3()};
  });
  read_list(root, "planes", info.planes, [](const Field& f) {
    return PlannedPlane{f.at("name").text(), f.at("point_mm").vec3(), f.at("normal").vec3()};
  });
  read_list(root, "regions", info.regions, read_region);
}

CaseDescription read_all(const Field& root, int version) {
  CaseDescription read;
  CaseInfo& info = read.info;
  info.schema_version = version;
  info.title = root.at("title").text();
  info.source = root.at("source").text();
  info.pitch_mm = root.at("pitch_mm").number();
  const Field calibration = root.at("calibration");
  info.calibration.slope_g_cm3_per_hu = calibration.at("slope_g_cm3_per_hu").number();
  info.calibration.intercept_g_cm3 = calibration.at("intercept_g_cm3").number();
  info.threshold_hu = root.at("segmentation").at("threshold_hu").number();
  read.content_hash = root.at("content_hash").digest();
  if (version >= 2) read_version_2(root, info);
  return read;
}

// ---- Hashing.

void hash_vec3(Hasher& hasher, const Vec3& v) {
  for (const double c : v) hasher.number(c);
}

void hash_provenance(Hasher& hasher, const LabelProvenance& provenance) {
  hasher.text(provenance.method);
  hasher.integer(provenance.parameters.size());
  for (const auto& [name, value] : provenance.parameters) {
    hasher.text(name);
    hasher.number(value);
  }
  hasher.integer(provenance.edits.size());
  for (const std::string& edit : provenance.edits) hasher.text(edit);
}

void hash_labels(Hasher& hasher, const std::vector<CaseLabel>& labels) {
  hasher.integer(labels.size());
  for (const CaseLabel& label : labels) {
    hasher.integer(static_cast<std::uint64_t>(label.value));
    hasher.text(label.name);
    hasher.text(name_of(label.kind));
    hash_provenance(hasher, label.provenance);
  }
}

void hash_plan(Hasher& hasher, const CaseInfo& info) {
  hasher.integer(info.landmarks.size());
  for (const Landmark& landmark : info.landmarks) {
    hasher.text(landmark.name);
    hash_vec3(hasher, landmark.point_mm);
  }
  hasher.integer(info.axes.size());
  for (const PlannedAxis& axis : info.axes) {
    hasher.text(axis.name);
    hash_vec3(hasher, axis.point_mm);
    hash_vec3(hasher, axis.direction);
  }
  hasher.integer(info.planes.size());
  for (const PlannedPlane& plane : info.planes) {
    hasher.text(plane.name);
    hash_vec3(hasher, plane.point_mm);
    hash_vec3(hasher, plane.normal);
  }
  hasher.integer(info.regions.size());
  for (const PlannedRegion& region : info.regions) {
    hasher.text(region.name);
    hasher.integer(static_cast<std::uint64_t>(region.label));
    if (region.label != 0) continue;
    hash_vec3(hasher, region.min_mm);
    hash_vec3(hasher, region.max_mm);
  }
}

}  // namespace

std::size_t ScanGeometry::count() const {
  return static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) * static_cast<std::size_t>(dims[2]);
}

std::string_view name_of(LabelKind kind) { return kKindNames.at(static_cast<std::size_t>(kind)); }

Result<void> check_description(const CaseInfo& info) try {
  check_numbers(info);
  if (info.schema_version != 1 && info.schema_version != kCaseSchemaVersion)
    fault("schema_version", "is neither 1 nor " + std::to_string(kCaseSchemaVersion));
  if (info.schema_version == 1 && has_more_than_version_1(info))
    fault("schema_version", "is 1, which has neither scan nor labels nor a plan");
  if (info.scan) check_scan(info.scan->geometry);
  check_labels("labels", info.labels);
  check_labels("tissues", info.tissues);
  check_plan(info);
  if (to_text({info, {}}).size() > kMostInfoBytes) fault("the description", "is longer than 1 MiB");
  return {};
} catch (const Fault& wrong) {
  return bad_input(wrong.what);
} catch (const json::exception&) {
  return bad_input("a text is not UTF-8");
}

void hash_description(Hasher& hasher, const CaseInfo& info) {
  hasher.integer(static_cast<std::uint64_t>(info.schema_version));
  hasher.text(info.title);
  hasher.text(info.source);
  hasher.number(info.pitch_mm);
  hasher.number(info.calibration.slope_g_cm3_per_hu);
  hasher.number(info.calibration.intercept_g_cm3);
  hasher.number(info.threshold_hu);
  if (info.schema_version == 1) return;
  hasher.integer(info.scan ? 1 : 0);
  if (info.scan) {
    hasher.bytes(std::as_bytes(std::span(info.scan->hash.bytes)));
    for (const int dim : info.scan->geometry.dims) hasher.integer(static_cast<std::uint64_t>(dim));
    hash_vec3(hasher, info.scan->geometry.origin_mm);
    for (int axis = 0; axis < 3; ++axis) hash_vec3(hasher, info.scan->geometry.axes_mm.col(axis));
  }
  hash_labels(hasher, info.labels);
  hash_labels(hasher, info.tissues);
  hash_plan(hasher, info);
  // Cases without it keep the hash that they had before the field existed.
  if (info.density_from) {
    hasher.text("calibration.provenance");
    hash_provenance(hasher, *info.density_from);
  }
}

std::string to_text(const CaseDescription& description) {
  const CaseInfo& info = description.info;
  json all{{"schema_version", info.schema_version},
           {"title", info.title},
           {"source", info.source},
           {"pitch_mm", info.pitch_mm},
           {"calibration",
            {{"slope_g_cm3_per_hu", info.calibration.slope_g_cm3_per_hu},
             {"intercept_g_cm3", info.calibration.intercept_g_cm3}}},
           {"segmentation", {{"threshold_hu", info.threshold_hu}}},
           {"content_hash", to_hex(description.content_hash)}};
  if (info.schema_version >= 2) {
    if (info.density_from) all["calibration"]["provenance"] = provenance_json(*info.density_from);
    if (info.scan) all["scan"] = scan_json(*info.scan);
    all["labels"] = list_of(info.labels, label_json);
    all["tissues"] = list_of(info.tissues, label_json);
    all["landmarks"] = list_of(info.landmarks, [](const Landmark& l) {
      return json{{"name", l.name}, {"point_mm", list_of(l.point_mm)}};
    });
    all["axes"] = list_of(info.axes, [](const PlannedAxis& a) {
      return json{{"name", a.name}, {"point_mm", list_of(a.point_mm)}, {"direction", list_of(a.direction)}};
    });
    all["planes"] = list_of(info.planes, [](const PlannedPlane& p) {
      return json{{"name", p.name}, {"point_mm", list_of(p.point_mm)}, {"normal", list_of(p.normal)}};
    });
    all["regions"] = list_of(info.regions, region_json);
  }
  return all.dump(2) + "\n";
}

Result<CaseDescription> read_description(const std::filesystem::path& file) {
  constexpr const char* kRemedy = "; import the case again";
  std::error_code unknown;
  if (std::filesystem::file_size(file, unknown) > kMostInfoBytes && !unknown)
    return bad_input(file.string() + " is longer than any case description" + kRemedy);
  std::ifstream in(file);
  if (!in) return bad_input(file.string() + " cannot be read" + kRemedy);
  try {
    const json all = json::parse(in);
    const Field root(all, "");
    const Field schema = root.at("schema_version");
    const json& version = all.at("schema_version");  // compared as JSON, because any number may be there
    if (version != 1 && version != kCaseSchemaVersion)
      return failure(ErrorCode::unsupported, file.string() + ": schema_version is " + version.dump().substr(0, 20) +
                                                 ", but this program reads the versions 1 to " +
                                                 std::to_string(kCaseSchemaVersion) +
                                                 "; install a newer Osteon, or import the case again with this one");
    CaseDescription read = read_all(root, version == 1 ? 1 : kCaseSchemaVersion);
    if (const Result<void> sound = check_description(read.info); !sound) throw Fault{sound.error().message};
    return read;
  } catch (const Fault& wrong) {
    return bad_input(file.string() + ": " + wrong.what + kRemedy);
  } catch (const json::exception& wrong) {
    return bad_input(file.string() + " is not a case description (" + bounded_text(wrong.what(), kMostQuoted * 4) +
                     ")" + kRemedy);
  }
}

}  // namespace osteon
