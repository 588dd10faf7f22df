#include "server/import/dicom_series.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <numbers>
#include <tuple>

namespace osteon::import {
namespace {

constexpr double kMostVoxels = 4e9;
constexpr double kLeastPixel_mm = 0.01, kMostPixel_mm = 20.0;
constexpr int kFewSlices = 8;            // fewer are not a volume to operate on
constexpr std::size_t kFewDoubled = 10;  // at most a tenth of the slices may lie where another one lies
constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr std::size_t kGroupsCompared = 64;  // of one UID; in hostile files every slice could differ

using Slices = std::vector<DicomHeader>;

Vec3 vec(const std::vector<double>& v, std::size_t first = 0) { return {v[first], v[first + 1], v[first + 2]}; }

bool has_spacing(const DicomHeader& h) {
  return h.spacing.size() == 2 &&
         std::ranges::all_of(h.spacing, [](double mm) { return mm >= kLeastPixel_mm && mm <= kMostPixel_mm; });
}
// Two unit vectors. With others, positions along the normal would not be finite numbers.
bool has_orientation(const DicomHeader& h) {
  return h.orientation.size() == 6 &&
         std::ranges::all_of(h.orientation, [](double part) { return std::abs(part) <= 1.1; });
}
bool has_place(const DicomHeader& h) { return has_spacing(h) && has_orientation(h) && h.position.size() == 3; }

// How the second differs from the first; null if both may be slices of one volume.
const char* difference(const DicomHeader& a, const DicomHeader& b) {
  if (a.has_frames_without_position() != b.has_frames_without_position())
    return b.has_frames_without_position() ? "several frames" : "a single frame";
  if (a.columns != b.columns || a.rows != b.rows) return "another size";
  if (a.samples != b.samples || a.photometric != b.photometric) return "other colours";
  if (has_spacing(a) != has_spacing(b) || (has_spacing(a) && (std::abs(a.spacing[0] - b.spacing[0]) >= 1e-4 ||
                                                              std::abs(a.spacing[1] - b.spacing[1]) >= 1e-4)))
    return "another pixel spacing";
  if (has_orientation(a) != has_orientation(b)) return "another orientation";
  if (has_orientation(a) && ((vec(a.orientation) - vec(b.orientation)).norm() >= 1e-3 ||
                             (vec(a.orientation, 3) - vec(b.orientation, 3)).norm() >= 1e-3))
    return "another orientation";
  return nullptr;
}

// Removes copied files: the same instance, and the same frame of it, at the same position. The largest is kept, because
// a copy may be truncated.
Slices without_copies(Slices slices, SkippedFiles& skipped, const FoundFiles& found) {
  std::map<std::tuple<std::string, std::string, std::vector<double>, int, int>, std::size_t> seen;
  Slices kept;
  for (DicomHeader& h : slices) {
    if (h.instance.empty()) {
      kept.push_back(std::move(h));
      continue;
    }
    const auto [place, is_new] =
        seen.try_emplace({h.series, h.instance, h.position, h.acquisition, h.frame}, kept.size());
    if (is_new) {
      kept.push_back(std::move(h));
      continue;
    }
    DicomHeader& first = kept[place->second];
    if (h.bytes > first.bytes) std::swap(first, h);
    skipped.add(FileKind::copy, found.files[h.file].name);
  }
  return kept;
}

// Slices of one UID that may belong to one volume.
std::vector<Slices> group_compatible(Slices slices) {
  std::vector<Slices> groups;
  for (DicomHeader& h : slices) {
    const std::size_t compared = std::min(groups.size(), kGroupsCompared);
    std::size_t at = 0;
    while (at < compared && difference(groups[at].front(), h) != nullptr) ++at;
    if (at == compared) at = groups.size(), groups.emplace_back();
    groups[at].push_back(std::move(h));
  }
  // The largest first, and those without spacing or orientation last.
  std::ranges::stable_sort(groups, std::greater{}, [](const Slices& g) {
    return std::pair(has_spacing(g.front()) && has_orientation(g.front()), g.size());
  });
  // A slice that has lost its spacing or orientation must not vanish from its series unreported.
  const auto is_lost = [](const Slices& g) { return !has_spacing(g.front()) || !has_orientation(g.front()); };
  const std::size_t compared = std::min(groups.size(), kGroupsCompared);
  std::vector<Slices> kept;
  for (Slices& group : groups) {
    const auto takes = [&](const Slices& g) {
      const DicomHeader &a = g.front(), &b = group.front();
      return !is_lost(g) && a.columns == b.columns && a.rows == b.rows &&
             a.has_frames_without_position() == b.has_frames_without_position();
    };
    const auto end = kept.begin() + static_cast<std::ptrdiff_t>(std::min(compared, kept.size()));
    const auto whole = is_lost(group) ? std::find_if(kept.begin(), end, takes) : end;
    if (whole != end)
      std::ranges::move(group, std::back_inserter(*whole));
    else
      kept.push_back(std::move(group));
  }
  return kept;
}

Vec3 normal_of(const DicomHeader& h) { return vec(h.orientation).cross(vec(h.orientation, 3)); }

bool places_repeat(const Slices& slices) {
  if (!std::ranges::all_of(slices, has_place)) return false;
  const Vec3 normal = normal_of(slices.front());
  std::vector<double> along;
  for (const DicomHeader& h : slices) along.push_back(normal.dot(vec(h.position)));
  std::ranges::sort(along);
  for (std::size_t i = 1; i < along.size(); ++i)
    if (along[i] - along[i - 1] < kSamePosition_mm) return true;
  return false;
}

// Splits a group whose positions repeat, by the first property after which no part has repeated positions.
std::vector<Slices> split_by_acquisition(Slices slices) {
  if (!places_repeat(slices)) return {std::move(slices)};
  using Mark = std::function<std::string(const DicomHeader&)>;
  const std::array<Mark, 4> marks = {[](const DicomHeader& h) { return std::to_string(h.acquisition); },
                                     [](const DicomHeader& h) { return std::to_string(h.temporal_position); },
                                     [](const DicomHeader& h) { return h.kernel; },
                                     [](const DicomHeader& h) { return h.image_type; }};
  for (const Mark& mark : marks) {
    std::map<std::string, Slices> parts;
    for (const DicomHeader& h : slices) parts[mark(h)].push_back(h);
    const auto sound = [](const auto& part) { return part.second.size() >= 2 && !places_repeat(part.second); };
    if (parts.size() < 2 || !std::ranges::all_of(parts, sound)) continue;
    std::vector<Slices> groups;
    for (auto& [value, part] : parts) groups.push_back(std::move(part));
    return groups;
  }
  return {std::move(slices)};
}

// Makes the grid of one series, or reports what is wrong with it.
class Arranger {
 public:
  Arranger(CtSeries& series, const FoundFiles& found, std::string subject, std::function<std::string()> missing)
      : series_(series), found_(found), subject_(std::move(subject)), missing_(std::move(missing)) {}

  std::optional<SeriesFault> run() {
    for (const DicomHeader& h : series_.slices)
      if (auto fault = check(h)) return fault;
    if (auto fault = axes()) return fault;
    if (auto fault = sort_by_position()) return fault;
    if (series_.slices.size() < 2)
      return wrong("a single slice", subject_ + " holds a single slice; a volume needs at least two");
    return stack();
  }

 private:
  [[nodiscard]] const DicomHeader& first() const { return series_.slices.front(); }
  [[nodiscard]] std::string name(const DicomHeader& slice) const {
    const std::string file = shown_text(found_.files[slice.file].name, 80);
    return slice.frame < 0 ? file : "frame " + std::to_string(slice.frame + 1) + " of " + file;
  }
  static SeriesFault wrong(const std::string& brief, const std::string& sentence,
                           ErrorCode code = ErrorCode::invalid_input) {
    return {brief, {code, sentence}};
  }

  // Checks one file alone. Missing attributes are named as DICOM names them.
  [[nodiscard]] std::optional<SeriesFault> check(const DicomHeader& h) const {
    const std::string file = found_.shown(h.file);
    const auto lacks = [&](const std::string& what) {
      return wrong("no valid " + what,
                   file + " has no valid " + what + "; export the series again as original CT slices");
    };
    const auto cannot = [&](const std::string& brief, const std::string& what) {
      return wrong(brief, file + " " + what, ErrorCode::unsupported);
    };
    if (h.has_frames_without_position())
      return cannot("several frames in a file",
                    "holds " + std::to_string(h.frames) +
                        " frames without a position for each; export the series with one file for each slice");
    if (h.columns < 2 || h.rows < 2 || h.columns > imaging::kLargestScanAxis || h.rows > imaging::kLargestScanAxis)
      return lacks("Rows and Columns (0028,0010-0011)");
    if (h.samples != 1 || h.photometric != "MONOCHROME2")
      return cannot(
          "no Hounsfield units",
          "stores " + h.photometric + " pixels instead of Hounsfield units (MONOCHROME2); export original CT slices");
    if (!h.is_hu)
      return cannot("no Hounsfield units",
                    "stores numbers that are not Hounsfield units, by its RescaleType (0028,1054); export original CT "
                    "slices");
    if (h.bits_allocated != 8 && h.bits_allocated != 16)
      return cannot("neither 8 nor 16 bits",
                    "stores " + std::to_string(h.bits_allocated) + " bits for a pixel; only 8 and 16 can be read");
    if (h.bits_stored < 1 || h.bits_stored > h.bits_allocated) return lacks("BitsStored (0028,0101)");
    if (!has_spacing(h)) return lacks("PixelSpacing (0028,0030)");
    if (h.position.size() != 3) return lacks("ImagePositionPatient (0020,0032)");
    if (!has_orientation(h)) return lacks("ImageOrientationPatient (0020,0037)");
    if (h.intercept.size() != 1 || h.slope.size() != 1 || h.slope[0] == 0.0)
      return lacks("RescaleSlope and RescaleIntercept (0028,1052-1053)");
    if (h.compression == Compression::retired)
      return cannot("a retired compression", "uses a retired JPEG compression (" + h.transfer_syntax +
                                                 "); export the series uncompressed or lossless");
    if (h.compression == Compression::unknown)
      return cannot("an unknown compression", "uses a compression that cannot be read (" +
                                                  shown_text(h.transfer_syntax, 64) +
                                                  "); export the series uncompressed or lossless");
    return std::nullopt;
  }

  std::optional<SeriesFault> axes() {
    const Vec3 across = vec(first().orientation).normalized();
    Vec3 down = vec(first().orientation, 3).normalized();
    const Vec3 normal = across.cross(down);
    if (!across.allFinite() || !down.allFinite() || !(std::abs(across.dot(down)) <= 1e-3) || !(normal.norm() > 0.99))
      return wrong(
          "no valid ImageOrientationPatient (0020,0037)",
          found_.shown(first().file) +
              ": ImageOrientationPatient (0020,0037) is not two perpendicular directions; export the series again");
    down = (down - across * across.dot(down)).normalized();
    directions_ << across, down, across.cross(down);
    return std::nullopt;
  }

  [[nodiscard]] double along(const DicomHeader& h) const { return directions_.col(2).dot(vec(h.position)); }

  // Of several slices at one position, the largest file is kept, because another may be truncated.
  std::optional<SeriesFault> sort_by_position() {
    Slices& slices = series_.slices;
    const std::size_t all = slices.size();
    std::ranges::stable_sort(slices, {}, [&](const DicomHeader& h) { return along(h); });
    Slices kept;
    std::string pair;
    for (DicomHeader& h : slices) {
      if (kept.empty() || along(h) - along(kept.back()) >= kSamePosition_mm) {
        kept.push_back(std::move(h));
        continue;
      }
      if (pair.empty()) pair = name(kept.back()) + " and " + name(h);
      if (h.bytes > kept.back().bytes) kept.back() = std::move(h);
    }
    slices = std::move(kept);
    series_.entry.doubled = static_cast<int>(all - slices.size());
    series_.entry.slices = static_cast<int>(slices.size());
    if (all - slices.size() <= std::max<std::size_t>(1, all / kFewDoubled)) return std::nullopt;
    series_.entry.slices = static_cast<int>(all);
    return wrong("several slices at one position",
                 subject_ + ": " + std::to_string(all - slices.size()) + " of its " + std::to_string(all) +
                     " slices lie at the position of another one, such as " + pair + "; remove the duplicates");
  }

  std::optional<SeriesFault> stack() {
    SliceStack stack{.columns = first().columns,
                     .rows = first().rows,
                     .column_mm = first().spacing[1],
                     .row_mm = first().spacing[0],
                     .directions = directions_,
                     .positions_mm = {}};
    std::vector<double> gaps_mm;
    for (const DicomHeader& h : series_.slices) {
      if (!stack.positions_mm.empty()) gaps_mm.push_back(along(h) - directions_.col(2).dot(stack.positions_mm.back()));
      stack.positions_mm.push_back(vec(h.position));
    }
    series_.entry.slice_mm = usual_gap_mm(gaps_mm);
    if (const auto at = gap_of_missing_slices(gaps_mm)) return missing_slices(*at, gaps_mm);

    SliceGrid& grid = series_.grid;
    grid = grid_of(stack);
    char text[160];
    const double slope = std::atan2(grid.sideways_mm, along(series_.slices.back()) - along(first())) * kDegrees;
    if (slope > kMostTilt_degrees) {
      std::snprintf(text, sizeof text, "sheared by %.1f degrees", slope);
      return wrong(text, subject_ + " is " + text + ", more than a gantry tilts; export it resampled to upright slices",
                   ErrorCode::unsupported);
    }
    const imaging::HuVolume& volume = grid.volume;
    if (static_cast<double>(volume.dims[0]) * volume.dims[1] * volume.dims[2] > kMostVoxels ||
        *std::ranges::max_element(volume.dims) > imaging::kLargestScanAxis)
      return wrong(
          "more than 4e9 voxels",
          subject_ + " has more than the 4e9 voxels that can be imported; export a part of it, or thicker slices");
    series_.entry.slice_mm = volume.spacing_mm.z();
    series_.entry.lossy =
        static_cast<int>(std::ranges::count(series_.slices, Compression::lossy, &DicomHeader::compression));
    series_.entry.irregularity = irregularity(grid);
    series_.entry.resampled = grid.places.empty() ? 0 : volume.dims[2];
    return std::nullopt;
  }

  [[nodiscard]] SeriesFault missing_slices(std::size_t at, const std::vector<double>& gaps_mm) const {
    char brief[64], text[96];
    std::snprintf(brief, sizeof brief, "a gap of %.3g mm", gaps_mm[at]);
    std::snprintf(text, sizeof text, " are %.3g mm apart where %.3g mm is usual", gaps_mm[at], usual_gap_mm(gaps_mm));
    return wrong(brief, subject_ + ": the slices " + name(series_.slices[at]) + " and " + name(series_.slices[at + 1]) +
                            text + missing_() + "; add the missing slices");
  }

  CtSeries& series_;
  const FoundFiles& found_;
  const std::string subject_;
  const std::function<std::string()> missing_;  // files that may belong into a gap
  Eigen::Matrix3d directions_ = Eigen::Matrix3d::Identity();
};

std::string plane_of(const DicomHeader& h) {
  const Vec3 normal = has_orientation(h) ? Vec3(normal_of(h).cwiseAbs()) : Vec3::Zero();
  if (!(normal.norm() > 0.5)) return {};
  return normal.z() > 0.95 ? "axial" : normal.y() > 0.95 ? "coronal" : normal.x() > 0.95 ? "sagittal" : "oblique";
}

SeriesEntry entry_of(const Slices& slices) {
  const DicomHeader& h = slices.front();
  SeriesEntry entry;
  entry.description = h.description;
  entry.kernel = h.kernel;
  entry.slices = static_cast<int>(slices.size());
  entry.rows = h.rows;
  entry.columns = h.columns;
  entry.plane = plane_of(h);
  if (has_spacing(h)) entry.row_mm = h.spacing[0], entry.column_mm = h.spacing[1];
  return entry;
}

// Files that belong to a series by its UID but are not slices of it. They may be what is missing in a gap. Groups of
// one UID are adjacent, and `no_pixels` is sorted by UID.
std::string possible_gap_causes(const std::vector<Slices>& groups, std::size_t at, const Slices& no_pixels,
                                const FoundFiles& found, const SkippedFiles& skipped) {
  const DicomHeader& own = groups[at].front();
  std::string text;
  int named = 0;
  const auto add = [&](const std::string& name, const std::string& what) {
    text += ", and " + shown_text(name, 80) + " " + what;
    return ++named < 2;
  };
  for (auto h = std::ranges::lower_bound(no_pixels, own.series, {}, &DicomHeader::series);
       h != no_pixels.end() && h->series == own.series; ++h)
    if (!add(found.files[h->file].name, "has no pixel data")) return text;
  std::size_t begin = at, end = at + 1;
  while (begin > 0 && groups[begin - 1].front().series == own.series) --begin;
  while (end < groups.size() && groups[end].front().series == own.series) ++end;
  for (std::size_t i = begin; i < end; ++i) {
    const DicomHeader& h = groups[i].front();
    const char* what = i == at || groups[i].size() > groups[at].size() ? nullptr : difference(own, h);
    if (what == nullptr) continue;
    const std::string detail =
        h.has_frames_without_position() ? "holds " + std::to_string(h.frames) + " frames" : std::string("has ") + what;
    if (!add(found.files[h.file].name, detail)) return text;
  }
  for (const SkippedFiles::Count& c : skipped.counts())
    if (c.kind == FileKind::damaged || c.kind == FileKind::unreadable)
      for (const std::string& name : c.names)
        if (!add(name, c.kind == FileKind::damaged ? "is damaged" : "cannot be opened")) return text;
  return text;
}

double voxels(const CtSeries& s) { return static_cast<double>(s.entry.slices) * s.entry.rows * s.entry.columns; }

// Error for an input without CT: reports what is there instead.
Error no_series(const FoundFiles& found, const SkippedFiles& skipped) {
  const std::string& input = found.input;
  if (skipped.empty())
    return {ErrorCode::invalid_input,
            input + (found.archive ? " holds no files" : " is empty") + "; give the folder with the CT series"};
  bool any_dicom = false;
  for (const SkippedFiles::Count& c : skipped.counts()) any_dicom = any_dicom || c.kind < FileKind::damaged;
  const bool only_archives = !any_dicom && skipped.count(FileKind::archive) > 0;
  std::string what = skipped.text(false);
  if (what.size() > 160) what = what.substr(0, what.rfind(", ", 160)) + " and more";
  const char* remedy = "give the folder with the CT series";
  if (only_archives)
    remedy = "unpack what is inside and give the folder";
  else if (skipped.count(FileKind::unknown_syntax) > 0)
    remedy = "export the series uncompressed";
  else if (any_dicom)
    remedy = "only original CT slices can be imported";
  else if (skipped.count(FileKind::not_dicom) > 0)
    remedy = "give the folder with the CT series, --spacing for PNG slices, or --size too for raw numbers";
  return {any_dicom ? ErrorCode::unsupported : ErrorCode::invalid_input,
          input + (any_dicom ? " holds no CT series: " : " holds no DICOM files: ") + what + "; " + remedy};
}

}  // namespace

std::vector<CtSeries> sort_series(std::vector<DicomHeader> headers, const FoundFiles& found, SkippedFiles& skipped) {
  std::map<std::pair<int, std::string>, Slices> by_uid;
  Slices no_pixels;
  for (DicomHeader& h : headers) {
    if (h.kind == FileKind::no_pixels) no_pixels.push_back(h);
    if (h.kind == FileKind::ct_slice)
      by_uid[{h.series_number, h.series}].push_back(std::move(h));
    else
      skipped.add(h.kind, found.files[h.file].name, h.kind == FileKind::other_modality ? h.modality : "");
  }
  std::ranges::stable_sort(no_pixels, {}, &DicomHeader::series);
  std::vector<Slices> groups;
  for (auto& [key, slices] : by_uid)
    for (Slices& group : group_compatible(without_copies(std::move(slices), skipped, found)))
      for (Slices& part : split_by_acquisition(std::move(group))) groups.push_back(std::move(part));

  std::vector<CtSeries> series(groups.size());
  for (std::size_t i = 0; i < groups.size(); ++i) {
    CtSeries& s = series[i];
    s.slices = groups[i];
    s.entry = entry_of(s.slices);
    s.entry.number = static_cast<int>(i) + 1;
    const std::string subject =
        groups.size() == 1 ? found.input : "series " + std::to_string(i + 1) + " of " + found.input;
    s.fault =
        Arranger(s, found, subject, [&] { return possible_gap_causes(groups, i, no_pixels, found, skipped); }).run();
    if (s.fault) s.entry.problem = s.fault->brief;
  }
  return series;
}

Result<std::size_t> choose_series(const std::vector<CtSeries>& series, const FoundFiles& found,
                                  const SkippedFiles& skipped, std::optional<int> number,
                                  std::optional<std::size_t> file) {
  if (series.empty()) return tl::unexpected(no_series(found, skipped));
  if (number) {
    if (*number >= 1 && *number <= static_cast<int>(series.size())) return static_cast<std::size_t>(*number) - 1;
    const std::string range = series.size() == 1 ? "only series 1" : "the series 1 to " + std::to_string(series.size());
    return failure(ErrorCode::invalid_input, "--series " + std::to_string(*number) + ": " + found.input + " has " +
                                                 range + "; osteon-import series lists them");
  }
  std::size_t largest = 0;
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (file && std::ranges::count(series[i].slices, *file, &DicomHeader::file) > 0) return i;
    if (voxels(series[i]) > voxels(series[largest])) largest = i;
    if (!series[i].fault && (!best || voxels(series[i]) > voxels(series[*best]))) best = i;
  }
  // A larger series with a missing or damaged slice is most likely the intended one. Importing another bone without
  // asking would be wrong. A larger series of a kind that nobody can import, such as one in colours, is not chosen.
  const CtSeries& most = series[largest];
  const bool is_meant =
      most.fault && most.fault->error.code != ErrorCode::unsupported && most.entry.slices >= kFewSlices;
  const bool whole = best && !is_meant && (series[*best].entry.slices >= kFewSlices || most.entry.slices < kFewSlices);
  return whole ? *best : largest;
}

}  // namespace osteon::import
