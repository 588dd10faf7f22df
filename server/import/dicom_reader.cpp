#include "server/import/dicom_reader.hpp"

#include <gdcmTrace.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#include "common/runtime/new_folder.hpp"
#include "server/import/archive_files.hpp"
#include "server/import/dicom_pixels.hpp"
#include "server/import/dicom_series.hpp"
#include "server/import/import_steps.hpp"
#include "server/import/isolated_reader.hpp"
#include "server/import/raw_nrrd.hpp"
#include "server/import/slice_images.hpp"

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr int kMostDeaths = 100;  // of processes that read headers
// Fewer files, or a smaller archive, are searched in a moment. Then no progress appears before an error.
constexpr std::size_t kManyFiles = 500;
constexpr std::size_t kPixelMemory_bytes = std::size_t{4} << 30;  // of a process that decodes; a file may be a series
constexpr std::uint64_t kLargeArchive = std::uint64_t{64} << 20;  // bytes
constexpr double kUnpackedEnd = 0.4;                              // of the progress of an archive
constexpr double kHeadersEnd = 0.6;

void silence_library() {
  gdcm::Trace::DebugOff();
  gdcm::Trace::WarningOff();
  gdcm::Trace::ErrorOff();
}

struct Input {
  FoundFiles found;
  std::optional<TemporaryFolder> folder;  // of an archive
  std::optional<std::size_t> named_file;  // if a slice was given
};

void pack(const FoundFiles& found, ByteWriter& to) {
  to.add(found.files.size());
  for (const FoundFile& f : found.files) to.add(f.path.string()), to.add(f.name);
  to.add(found.skipped.counts().size());
  for (const SkippedFiles::Count& c : found.skipped.counts()) {
    to.add(c.kind), to.add(c.count), to.add(c.names.size());
    for (const std::string& name : c.names) to.add(name);
  }
}

bool unpack(ByteReader& from, FoundFiles& found) {
  std::size_t size = 0;
  if (!from.get(size) || size > kMostFiles) return false;
  for (std::size_t i = 0; i < size; ++i) {
    std::string path, name;
    if (!from.get(path) || !from.get(name)) return false;
    found.files.push_back({path, name});
  }
  if (!from.get(size)) return false;
  for (std::size_t i = 0; i < size; ++i) {
    FileKind kind{};
    int count = 0;
    std::size_t names = 0;
    if (!from.get(kind) || !from.get(count) || !from.get(names)) return false;
    if (kind > FileKind::too_deep || count < 0 || count > kMostFiles || names > static_cast<std::size_t>(count))
      return false;
    SkippedFiles skipped;
    for (std::size_t j = 0; j < names; ++j) {
      std::string name;
      if (!from.get(name)) return false;
      skipped.add(kind, name);
    }
    found.skipped.add(skipped);
    for (int j = static_cast<int>(names); j < count; ++j) found.skipped.add(kind, "");
  }
  return true;
}

Result<Input> unpacked(const fs::path& archive, const KeepGoing& keep_going) {
  auto folder = TemporaryFolder::make();
  if (!folder) return tl::unexpected(folder.error());
  Input input{.found = {}, .folder = std::move(*folder), .named_file = {}};
  const fs::path into = input.folder->path();
  IsolatedWork work;
  work.run = [&](ChildChannel& channel) -> Result<void> {
    const auto found = unpack_archive(archive, into, {}, [&](double fraction) {
      channel.progress(fraction);
      return true;  // the parent ends this process if the user stops the import
    });
    if (!found) return tl::unexpected(found.error());
    ByteWriter packer;
    pack(*found, packer);
    channel.send(packer.bytes());
    return {};
  };
  work.on_message = [&](std::string_view message) {
    ByteReader from(message);
    return unpack(from, input.found);
  };
  const IsolatedEnd end = run_isolated(work, keep_going);
  if (end.died)
    return failure(ErrorCode::invalid_input,
                   archive.string() + " is damaged so that it cannot be read; copy or export it again");
  if (!end.result) return tl::unexpected(end.result.error());
  input.found.input = archive.string();
  input.found.archive = true;
  return input;
}

// Reads all headers, in one process after the other. If one dies, its file is damaged, and the next continues after it.
Result<std::vector<DicomHeader>> read_all_headers(const FoundFiles& found, const KeepGoing& keep_going) {
  std::vector<DicomHeader> headers;
  const std::size_t files = found.files.size();
  std::size_t next = 0;
  IsolatedWork work;
  work.run = [&](ChildChannel& channel) -> Result<void> {
    silence_library();
    for (std::size_t i = next; i < files; ++i) {
      channel.at_file(i);
      channel.progress(static_cast<double>(i) / static_cast<double>(files));
      const std::vector<DicomHeader> of_file = read_headers(found.files[i].path);
      ByteWriter packer;
      packer.add(i), packer.add(of_file.size());
      for (const DicomHeader& h : of_file) h.pack(packer);
      channel.send(packer.bytes());
    }
    return {};
  };
  work.on_message = [&](std::string_view message) {
    ByteReader from(message);
    std::size_t file = 0, count = 0;
    if (!from.get(file) || !from.get(count) || file != next || next >= files) return false;
    for (std::size_t i = 0; i < count; ++i) {
      DicomHeader h;
      if (!h.unpack(from)) return false;
      h.file = file;
      headers.push_back(std::move(h));
    }
    ++next;
    return true;
  };
  for (int deaths = 0; next < files; ++deaths) {
    const IsolatedEnd end = run_isolated(work, keep_going);
    if (end.result && next == files) break;
    if (!end.died)
      return tl::unexpected(end.result ? Error{ErrorCode::internal, "the reader of " + found.input + " ended early"}
                                       : end.result.error());
    if (deaths == kMostDeaths)
      return failure(ErrorCode::invalid_input, found.input + " holds more than " + std::to_string(kMostDeaths) +
                                                   " damaged files, such as " + found.shown(next) +
                                                   "; copy or export it again");
    DicomHeader damaged;
    damaged.file = next++;
    headers.push_back(std::move(damaged));
  }
  return headers;
}

Result<Input> find_input(const fs::path& path, const KeepGoing& keep_going) {
  const auto searched = [&](const fs::path& folder, int levels) -> Result<Input> {
    auto found = find_files(folder, levels, keep_going);
    if (!found) return tl::unexpected(found.error());
    return Input{.found = std::move(*found), .folder = {}, .named_file = {}};
  };
  switch (input_kind(path, keep_going)) {
    case InputKind::folder:
      return searched(path, kMostLevels);
    case InputKind::archive:
      return unpacked(path, keep_going);
    case InputKind::dicom_file:
      break;
    case InputKind::absent:
      return failure(ErrorCode::not_found, "there is no file or folder " + path.string() +
                                               "; give a folder, zip or ISO image with a CT series");
    default:
      return failure(ErrorCode::invalid_input,
                     path.string() + " is not a folder, zip, ISO image or DICOM file; give one with a CT series");
  }
  // The files that a DICOMDIR lists lie below it, and a slice's series lies beside it.
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  FoundFiles alone{
      .input = path.string(), .archive = false, .files = {{path, path.filename().string()}}, .skipped = {}};
  const auto header = read_all_headers(alone, keep_going);
  if (!header) return tl::unexpected(header.error());
  const bool is_index = header->front().kind == FileKind::index;
  auto input = searched(folder, is_index ? kMostLevels : -1);
  if (!input || is_index) return input;
  const auto named = std::ranges::find(input->found.files, path.filename().string(), &FoundFile::name);
  if (named != input->found.files.end())
    input->named_file = static_cast<std::size_t>(named - input->found.files.begin());
  return input;
}

// Fills the series' volume plane by plane.
Result<void> read_volume(CtSeries& series, const FoundFiles& found, const KeepGoing& keep_going) {
  imaging::HuVolume& volume = series.grid.volume;
  try {
    volume.values.resize(volume.count());
  } catch (const std::bad_alloc&) {
    return failure(ErrorCode::exhausted, found.input + ": this machine has no memory for a volume of " +
                                             imaging::describe(volume) + "; export thicker slices");
  }
  const std::size_t pixels = static_cast<std::size_t>(volume.dims[0]) * static_cast<std::size_t>(volume.dims[1]);
  const std::size_t slices = series.slices.size(), planes = static_cast<std::size_t>(volume.dims[2]);
  std::size_t next = 0;
  IsolatedWork work;
  work.memory_bytes = kPixelMemory_bytes;
  work.run = [&](ChildChannel& channel) -> Result<void> {
    silence_library();
    std::vector<std::int16_t> slice(static_cast<std::size_t>(series.entry.columns) *
                                    static_cast<std::size_t>(series.entry.rows));
    const auto send = [&](std::span<const std::int16_t> plane) {
      channel.send({reinterpret_cast<const char*>(plane.data()), plane.size_bytes()});
    };
    PixelReader reader;
    std::optional<SliceResampler> resampler;
    if (!series.grid.places.empty()) resampler.emplace(series.grid, series.entry.columns, series.entry.rows);
    for (std::size_t i = 0; i < slices; ++i) {
      channel.at_file(series.slices[i].file);
      if (auto read = reader.read(series.slices[i], found.files[series.slices[i].file].path,
                                  found.shown(series.slices[i].file), slice);
          !read)
        return read;
      if (resampler)
        resampler->add(slice, send);
      else
        send(slice);
      channel.progress(static_cast<double>(i + 1) / static_cast<double>(slices));
    }
    return {};
  };
  work.on_message = [&](std::string_view message) {
    if (next == planes || message.size() != pixels * sizeof(std::int16_t)) return false;
    std::memcpy(volume.values.data() + pixels * next++, message.data(), message.size());
    return true;
  };
  const IsolatedEnd end = run_isolated(work, keep_going);
  if (end.died && end.file)
    return failure(ErrorCode::invalid_input,
                   found.shown(*end.file) + " is damaged so that it cannot be read; copy or export it again");
  if (!end.result) return tl::unexpected(end.result.error());
  if (next != planes) return failure(ErrorCode::internal, "the reader of " + found.input + " ended early");
  return {};
}

struct Survey {
  Input input;
  std::vector<CtSeries> series;
  SeriesReport report;
};

Result<Survey> survey(const fs::path& path, const KeepGoing& keep_going) {
  std::error_code error;
  bool shows = fs::is_regular_file(path, error) && fs::file_size(path, error) > kLargeArchive;
  const KeepGoing shown = [&](double fraction) { return keep_going(shows ? fraction : 0.0); };
  const KeepGoing unpacking = part(shown, 0.0, kUnpackedEnd);
  auto input = find_input(path, unpacking);
  if (!input) return tl::unexpected(input.error());
  shows = shows || input->found.files.size() > kManyFiles;
  const KeepGoing scanning = part(shown, input->folder ? kUnpackedEnd : 0.0, kHeadersEnd);
  auto headers = read_all_headers(input->found, scanning);
  if (!headers) return tl::unexpected(headers.error());
  Survey result{.input = std::move(*input), .series = {}, .report = {}};
  result.report.skipped = result.input.found.skipped;
  result.series = sort_series(std::move(*headers), result.input.found, result.report.skipped);
  for (const CtSeries& s : result.series) result.report.series.push_back(s.entry);
  return result;
}

Result<std::size_t> choose(const Survey& s, std::optional<int> number) {
  return choose_series(s.series, s.input.found, s.report.skipped, number, s.input.named_file);
}

Result<SeriesReport> report_of(Survey found) {
  const auto chosen = choose(found, {});
  if (!chosen) return tl::unexpected(chosen.error());
  SeriesReport report = std::move(found.report);
  if (!found.series[*chosen].fault) report.taken = found.series[*chosen].entry.number;
  return report;
}

std::size_t middle_of(const CtSeries& series) { return series.slices.size() / 2; }

// The HU of the slice in the middle. Errors: invalid_input (damaged), cancelled.
Result<std::vector<std::int16_t>> middle_slice(const CtSeries& series, const FoundFiles& found,
                                               const KeepGoing& keep_going) {
  const DicomHeader& header = series.slices[middle_of(series)];
  std::vector<std::int16_t> hu(static_cast<std::size_t>(series.entry.columns) *
                               static_cast<std::size_t>(series.entry.rows));
  IsolatedWork work;
  work.memory_bytes = kPixelMemory_bytes;
  work.run = [&](ChildChannel& channel) -> Result<void> {
    silence_library();
    PixelReader reader;
    if (auto read = reader.read(header, found.files[header.file].path, found.shown(header.file), hu); !read)
      return read;
    channel.send({reinterpret_cast<const char*>(hu.data()), hu.size() * sizeof(std::int16_t)});
    return {};
  };
  work.on_message = [&](std::string_view message) {
    if (message.size() != hu.size() * sizeof(std::int16_t)) return false;
    std::memcpy(hu.data(), message.data(), message.size());
    return true;
  };
  const IsolatedEnd end = run_isolated(work, keep_going);
  if (!end.result) return tl::unexpected(end.result.error());
  return hu;
}

// Of one slice at its place among the others. The slices are the planes of the series' grid.
Result<void> write_slice(const CtSeries& series, const std::vector<std::int16_t>& hu, const fs::path& file) {
  const imaging::HuVolume& all = series.grid.volume;
  imaging::HuVolume one;
  one.dims = {all.dims[0], all.dims[1], 1};
  one.spacing_mm = all.spacing_mm;
  one.directions = all.directions;
  one.origin_mm = all.position_mm({0.0, 0.0, static_cast<double>(middle_of(series))});
  return write_raw_nrrd(one, hu, file, [](double) { return true; });
}

// Errors: internal (disk), cancelled.
Result<void> draw_all(const Survey& survey, const fs::path& folder, bool with_hu, const KeepGoing& keep_going) {
  const auto count = static_cast<double>(survey.series.size());
  double done = 0.0;
  for (const CtSeries& series : survey.series) {
    if (!keep_going(done / count)) return stopped_while("drawing the series");
    const auto hu =
        series.fault ? Result<std::vector<std::int16_t>>()
                     : middle_slice(series, survey.input.found, part(keep_going, done / count, (done + 1.0) / count));
    done += 1.0;
    if (!hu && hu.error().code == ErrorCode::cancelled) return tl::unexpected(hu.error());
    if (!hu || hu->empty()) continue;
    const std::string name = "series-" + std::to_string(series.entry.number);
    if (auto drawn = write_slice_image(*hu, series.entry.columns, imaging::Window{}, folder / (name + ".png")); !drawn)
      return drawn;
    if (!with_hu || !series.grid.places.empty()) continue;
    if (auto written = write_slice(series, *hu, folder / (name + ".nrrd")); !written) return written;
  }
  return {};
}

}  // namespace

Result<CtScan> read_dicom_series(const fs::path& input, const SeriesOptions& options, const KeepGoing& keep_going) {
  auto found = survey(input, keep_going);
  if (!found) return tl::unexpected(found.error());
  const auto chosen = choose(*found, options.series);
  if (!chosen) return tl::unexpected(chosen.error());
  CtSeries& series = found->series[*chosen];
  if (series.fault) {
    Error error = series.fault->error;
    const bool another = std::ranges::any_of(found->series, [](const CtSeries& s) { return !s.fault; });
    if (another && !options.series) error.message += ", or take another series by --series N";
    return tl::unexpected(error);
  }
  const KeepGoing reading = part(keep_going, kHeadersEnd, 1.0);
  if (auto read = read_volume(series, found->input.found, reading); !read) return tl::unexpected(read.error());
  CtScan scan{.volume = std::move(series.grid.volume), .report = std::move(found->report)};
  scan.source = "DICOM CT, " + imaging::describe(scan.volume);
  if (series.entry.resampled > 0) scan.source += ", resampled from slices " + series.entry.irregularity;
  if (series.entry.lossy > 0) scan.source += ", compressed with loss";
  scan.report.taken = series.entry.number;
  scan.frame_of_reference = series.slices.front().frame_of_reference;
  return scan;
}

Result<SeriesReport> list_dicom_series(const fs::path& input, const KeepGoing& keep_going) {
  auto found = survey(input, keep_going);
  if (!found) return tl::unexpected(found.error());
  return report_of(std::move(*found));
}

Result<SeriesReport> draw_dicom_series(const fs::path& input, const fs::path& folder, bool with_hu,
                                       const KeepGoing& keep_going) {
  auto found = survey(input, keep_going);
  if (!found) return tl::unexpected(found.error());
  if (const auto chosen = choose(*found, {}); !chosen) return tl::unexpected(chosen.error());
  auto written = write_new_folder(folder, [&](const fs::path& partial) {
    return draw_all(*found, partial, with_hu, part(keep_going, kHeadersEnd, 1.0));
  });
  if (!written) return tl::unexpected(written.error());
  return report_of(std::move(*found));
}

}  // namespace osteon::import
