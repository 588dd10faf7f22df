// Targets for scans: a DICOM slice or segmentation, an InVesalius project, and archives of slices.
#include <gdcmTrace.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "common/core/check.hpp"
#include "server/import/archive_files.hpp"
#include "server/import/dicom_pixels.hpp"
#include "server/import/dicom_segments.hpp"
#include "server/import/dicom_series.hpp"
#include "server/import/inv3_reader.hpp"
#include "server/import/isolated_reader.hpp"
#include "tests/fuzz/archive_bytes.hpp"
#include "tests/fuzz/import_files.hpp"
#include "tests/fuzz/import_targets.hpp"

namespace osteon::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExplicit = "1.2.840.10008.1.2.1";
constexpr const char* kImplicit = "1.2.840.10008.1.2";
constexpr int kRows = 4, kColumns = 5;
constexpr std::size_t kMostResampled = 1 << 16;  // voxels
// GDCM allocates and clears what a damaged length claims. When an assertion fails, this memory is leaked. No valid
// input needs more than this.
constexpr std::size_t kMostBytesAtOnce = std::size_t{4} << 20;

bool keep_going(double) { return true; }

// Elements of a DICOM data set, little endian.
class DataSet {
 public:
  explicit DataSet(bool explicit_vr) : explicit_vr_(explicit_vr) {}
  DataSet& add(std::uint16_t group, std::uint16_t element, const char* vr, std::string value) {
    if (value.size() % 2 != 0) value += std::string_view(vr) == "UI" ? '\0' : ' ';
    number(group, 2), number(element, 2);
    const bool is_long = std::string_view(vr) == "OW" || std::string_view(vr) == "OB" || std::string_view(vr) == "SQ";
    if (explicit_vr_) bytes_ += vr;
    if (explicit_vr_ && is_long) bytes_ += std::string(2, '\0');
    number(value.size(), explicit_vr_ && !is_long ? 2 : 4);
    bytes_ += value;
    return *this;
  }
  DataSet& add_number(std::uint16_t group, std::uint16_t element, std::uint16_t value) {
    return add(group, element, "US", {static_cast<char>(value & 0xff), static_cast<char>(value >> 8)});
  }
  DataSet& append(const std::string& elements) {
    bytes_ += elements;
    return *this;
  }
  // A sequence of one item, or one of several that are already items.
  DataSet& add_item(std::uint16_t group, std::uint16_t element, const DataSet& content) {
    return add(group, element, "SQ", content.as_item());
  }
  [[nodiscard]] std::string as_item() const {
    DataSet item(explicit_vr_);
    item.number(0xfffe, 2), item.number(0xe000, 2), item.number(bytes_.size(), 4);
    return item.bytes_ + bytes_;
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  void number(std::size_t value, int count) {
    for (int i = 0; i < count; ++i) bytes_ += static_cast<char>(value >> 8 * i & 0xff);
  }
  bool explicit_vr_;
  std::string bytes_;
};

// Item by item, each with its length.
std::string items(const std::vector<std::string>& sets) {
  std::string value;
  for (const std::string& set : sets) {
    value += std::string("\xfe\xff\x00\xe0", 4);
    for (int i = 0; i < 4; ++i) value += static_cast<char>(set.size() >> 8 * i & 0xff);
    value += set;
  }
  return value;
}

// The same slice in two frames, 2 mm apart, whose place is in functional groups.
std::string functional_groups() {
  const auto group = [](std::uint16_t group, std::uint16_t element, const DataSet& item) {
    return DataSet(true).add(group, element, "SQ", items({item.bytes()})).bytes();
  };
  const std::string shared =
      group(0x20, 0x9116, DataSet(true).add(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0")) +
      group(0x28, 0x9110, DataSet(true).add(0x28, 0x30, "DS", "0.5\\0.75")) +
      group(0x28, 0x9145, DataSet(true).add(0x28, 0x1052, "DS", "-1024").add(0x28, 0x1053, "DS", "1"));
  std::vector<std::string> frames;
  for (const char* position : {"-10\\-20\\30", "-10\\-20\\32"})
    frames.push_back(group(0x20, 0x9111, DataSet(true).add_number(0x20, 0x9156, 1)) +
                     group(0x20, 0x9113, DataSet(true).add(0x20, 0x32, "DS", position)));
  return DataSet(true).add(0x5200, 0x9229, "SQ", items({shared})).add(0x5200, 0x9230, "SQ", items(frames)).bytes();
}

std::string a_slice(const std::string& syntax, bool enhanced = false) {
  const std::string ct = "1.2.840.10008.5.1.4.1.1.2";
  DataSet meta(true);
  meta.add(2, 2, "UI", ct).add(2, 3, "UI", "1.2.3.4.5").add(2, 0x10, "UI", syntax);
  DataSet data(syntax == kExplicit);
  data.add(8, 8, "CS", "ORIGINAL\\PRIMARY\\AXIAL")
      .add(8, 0x16, "UI", ct)
      .add(8, 0x18, "UI", "1.2.3.4.5")
      .add(8, 0x60, "CS", "CT");
  data.add(8, 0x103e, "LO", "HEAD 1.0").add(0x18, 0x1210, "SH", "H60s");
  data.add(0x20, 0x0e, "UI", "1.2.3.4").add(0x20, 0x11, "IS", "1").add(0x20, 0x32, "DS", "-10\\-20\\30");
  data.add(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0").add_number(0x28, 2, 1).add(0x28, 4, "CS", "MONOCHROME2");
  if (enhanced) data.add(0x28, 8, "IS", "2");
  data.add_number(0x28, 0x10, kRows).add_number(0x28, 0x11, kColumns).add(0x28, 0x30, "DS", "0.5\\0.75");
  data.add_number(0x28, 0x100, 16).add_number(0x28, 0x101, 12).add_number(0x28, 0x102, 11).add_number(0x28, 0x103, 0);
  data.add(0x28, 0x1052, "DS", "-1024").add(0x28, 0x1053, "DS", "1");
  std::string pixels;
  for (int i = 0; i < kRows * kColumns; ++i) pixels += {static_cast<char>(i), static_cast<char>(i % 16)};
  if (enhanced) data.append(functional_groups()), pixels += pixels;
  data.add(0x7fe0, 0x10, "OW", pixels);
  const auto length = static_cast<char>(meta.bytes().size());
  const std::string head = DataSet(true).add(2, 0, "UL", {length, 0, 0, 0}).bytes();
  return std::string(128, '\0') + "DICM" + head + meta.bytes() + data.bytes();
}

// Two segments in two slices of 4 x 5 pixels.
std::string a_segmentation(const std::string& syntax) {
  const bool is_explicit = syntax == kExplicit;
  const std::string seg = "1.2.840.10008.5.1.4.1.1.66.4";
  DataSet meta(true);
  meta.add(2, 2, "UI", seg).add(2, 3, "UI", "1.2.3.4.5").add(2, 0x10, "UI", syntax);
  std::string segments, frames;
  for (const std::uint16_t number : {1, 2}) {
    segments += DataSet(is_explicit)
                    .add_number(0x62, 4, number)
                    .add(0x62, 5, "LO", number == 1 ? "Femur" : "Segment_2")
                    .add_item(0x62, 0xf, DataSet(is_explicit).add(8, 0x104, "LO", "Vein"))
                    .as_item();
    for (const char* position : {"-10\\-20\\30", "-10\\-20\\32"})
      frames += DataSet(is_explicit)
                    .add_item(0x20, 0x9113, DataSet(is_explicit).add(0x20, 0x32, "DS", position))
                    .add_item(0x62, 0xa, DataSet(is_explicit).add_number(0x62, 0xb, number))
                    .as_item();
  }
  DataSet shared(is_explicit);
  shared.add_item(0x20, 0x9116, DataSet(is_explicit).add(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0"));
  shared.add_item(0x28, 0x9110, DataSet(is_explicit).add(0x18, 0x88, "DS", "2").add(0x28, 0x30, "DS", "0.5\\0.75"));
  DataSet data(is_explicit);
  data.add(8, 0x16, "UI", seg).add(8, 0x60, "CS", "SEG").add(0x20, 0x52, "UI", "1.2.3.4");
  data.add(0x28, 8, "IS", "4").add_number(0x28, 0x10, kRows).add_number(0x28, 0x11, kColumns);
  data.add_number(0x28, 0x100, 1).add(0x62, 1, "CS", "BINARY").add(0x62, 2, "SQ", segments);
  data.add_item(0x5200, 0x9229, shared).add(0x5200, 0x9230, "SQ", frames);
  data.add(0x7fe0, 0x10, "OB", "0123456789");
  const auto length = static_cast<char>(meta.bytes().size());
  const std::string head = DataSet(true).add(2, 0, "UL", {length, 0, 0, 0}).bytes();
  return std::string(128, '\0') + "DICM" + head + meta.bytes() + data.bytes();
}

void read_segments(const fs::path& file) {
  import::DicomSegmentation header;
  const auto read = import::read_segmentation(
      file, "a", [&](const import::DicomSegmentation& found) { header = found; },
      [&](std::size_t segment, const std::vector<imaging::VoxelRun>& runs) {
        OSTEON_CHECK(segment < header.segments.size());
        for (const imaging::VoxelRun& run : runs)
          OSTEON_CHECK(run.first >= 0 && run.first <= run.last && run.last < header.dims[0] && run.row >= 0 &&
                       run.row < header.dims[1] && run.slice >= 0 && run.slice < header.dims[2]);
      });
  if (!read) return expect_bounded(read.error());
  OSTEON_CHECK(std::ranges::all_of(header.spacing_mm, [](double spacing) { return spacing > 0.0; }));
}

// Reads the slice and a second one beside it, as of a tilted gantry, as the import does: headers, series, the pixels of
// what can be imported, and the planes of the grid.
void read_slice(const fs::path& file) {
  std::vector<import::DicomHeader> headers = import::read_headers(file);
  import::DicomHeader beside = headers.front();
  beside.instance += ".1";
  beside.file = 1;
  if (beside.position.size() == 3) beside.position[1] += 1.0, beside.position[2] += 2.0;
  const import::FoundFiles found{.input = "scan", .archive = false, .files = {{file, "a"}, {file, "b"}}, .skipped = {}};
  import::SkippedFiles skipped;
  headers.push_back(beside);
  auto series = import::sort_series(headers, found, skipped);
  OSTEON_CHECK(skipped.text().size() < 4096);
  const auto chosen = import::choose_series(series, found, skipped, {}, {});
  if (!chosen) return expect_bounded(chosen.error());
  const import::CtSeries& taken = series[*chosen];
  if (taken.fault) return expect_bounded(taken.fault->error);
  std::vector<std::int16_t> out(static_cast<std::size_t>(taken.entry.columns) *
                                static_cast<std::size_t>(taken.entry.rows));
  import::PixelReader reader;
  const auto read = reader.read(taken.slices.back(), file, "a", out);
  if (!read) return expect_bounded(read.error());
  const imaging::HuVolume& volume = taken.grid.volume;
  if (taken.grid.places.empty() || volume.count() > kMostResampled) return;
  import::SliceResampler resampler(taken.grid, taken.entry.columns, taken.entry.rows);
  int planes = 0;
  for (std::size_t i = 0; i < taken.slices.size(); ++i) resampler.add(out, [&](auto) { ++planes; });
  OSTEON_CHECK(planes == volume.dims[2]);
}

// GDCM aborts by assert() on some damaged files, so the import reads them in child processes. Here the target leaves
// such an input by longjmp, and the library's memory is leaked.
std::jmp_buf on_assertion;
bool in_library = false;

// Limits what the library may allocate while it reads one input, as in the import's child process. Returns the limit
// before.
rlimit allow_memory(rlim_t more_bytes) {
  rlimit before{}, limit{};
  ::getrlimit(RLIMIT_AS, &before);
  std::ifstream file("/proc/self/statm");
  rlim_t pages = 0;
  if (!import::limits_memory() || !(file >> pages)) return before;  // sanitizers have an option for this
  limit = before;
  limit.rlim_cur = std::min(before.rlim_max, pages * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE)) + more_bytes);
  ::setrlimit(RLIMIT_AS, &limit);
  return before;
}

void read_guarded(const fs::path& file, void (*read)(const fs::path&) = read_slice) {
  const rlimit before = allow_memory(rlim_t{256} << 20);
  if (setjmp(on_assertion) == 0) {
    in_library = true;
    read(file);
    in_library = false;
  }
  ::setrlimit(RLIMIT_AS, &before);
}

void read_dicom(std::span<const std::uint8_t> data) {
  static const InputFile file("slice.dcm");
  read_guarded(file.write(data));
}

void read_dicom_seg(std::span<const std::uint8_t> data) {
  static const InputFile file("segments.dcm");
  read_guarded(file.write(data), read_segments);
}

void read_project(std::span<const std::uint8_t> data) {
  static const InputFile file("project.inv3");
  const auto scan = import::read_inv3(file.write(data), keep_going);
  if (!scan) return expect_bounded(scan.error());
  OSTEON_CHECK(scan->volume.values.size() == scan->volume.count() && scan->volume.spacing_mm.minCoeff() > 0.0);
}

void read_archive(std::span<const std::uint8_t> data) {
  // Small limits, so that an input can exceed each.
  constexpr import::ArchiveLimits kLimits{.entries = 8, .bytes = 1 << 16, .spare_bytes = 0};
  static const InputFile file("scan");
  const test::TempDir into;
  const auto found = import::unpack_archive(file.write(data), into.path(), kLimits, keep_going);
  if (!found) return expect_bounded(found.error());
  OSTEON_CHECK(found->files.size() <= 8);
  std::uintmax_t bytes = 0;
  for (const import::FoundFile& unpacked : found->files) {
    OSTEON_CHECK(unpacked.path.parent_path() == into.path());
    bytes += fs::file_size(unpacked.path);
    read_guarded(unpacked.path);
  }
  OSTEON_CHECK(bytes <= kLimits.bytes);
}

Bytes a_project(bool gzip) {
  const std::string list =
      "<?xml version=\"1.0\"?><plist "
      "version=\"1.0\"><dict><key>modality</key><string>CT</string><key>orientation</key><integer>1</integer>"
      "<key>matrix</key><dict><key>dtype</key><string>int16</string><key>filename</key><string>matrix.dat</"
      "string><key>shape</key><array>"
      "<integer>2</integer><integer>3</integer><integer>4</integer></array></dict><key>spacing</key><array><real>0.5</"
      "real><real>0.75</real>"
      "<real>2.0</real></array></dict></plist>";
  return an_archive({{"tmp/matrix.dat", std::string(48, 'm')}, {"tmp/main.plist", list}},
                    {.format = "pax", .gzip = gzip});
}

}  // namespace

// [any thread] Replaces the C library's function, only for the assertions of the library.
extern "C" [[noreturn]] void __assert_fail(const char* expression, const char* file, unsigned line,
                                           const char*) noexcept {
  if (std::exchange(in_library, false)) std::longjmp(on_assertion, 1);
  std::fprintf(stderr, "%s:%u: assertion failed: %s\n", file, line, expression);
  std::abort();
}

Target dicom_segments_target() {
  gdcm::Trace::DebugOff();
  gdcm::Trace::WarningOff();
  gdcm::Trace::ErrorOff();
  Target target{"dicom_segments",
                read_dicom_seg,
                {bytes_of_text(a_segmentation(kExplicit)), bytes_of_text(a_segmentation(kImplicit))}};
  target.mutations = 40;
  target.most_bytes_at_once = kMostBytesAtOnce;
  return target;
}

Target dicom_target() {
  gdcm::Trace::DebugOff();
  gdcm::Trace::WarningOff();
  gdcm::Trace::ErrorOff();
  Target target{
      "dicom",
      read_dicom,
      {bytes_of_text(a_slice(kExplicit)), bytes_of_text(a_slice(kImplicit)), bytes_of_text(a_slice(kExplicit, true))}};
  target.mutations = 40;
  target.most_bytes_at_once = kMostBytesAtOnce;
  return target;
}

Target inv3_target() {
  Target target{"inv3", read_project, {a_project(false), a_project(true)}};
  target.change = change_number;
  target.mutations = 200;
  return target;
}

Target scan_archive_target() {
  const std::vector<std::pair<std::string, std::string>> files{{"CD/IM1", a_slice(kExplicit)},
                                                               {"CD/README.TXT", "nothing"}};
  Target target{
      "scan_archive",
      read_archive,
      {an_archive(files, {}), an_archive(files, {.zip_compression = "store"}), an_archive(files, {.format = "pax"}),
       an_archive(files, {.format = "pax", .gzip = true}), an_archive(files, {.format = "iso9660"})}};
  target.mutations = 50;
  target.most_bytes_at_once = kMostBytesAtOnce;
  return target;
}

}  // namespace osteon::fuzz
