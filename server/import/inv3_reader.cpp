#include "server/import/inv3_reader.hpp"

#include <archive.h>
#include <archive_entry.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <new>
#include <pugixml.hpp>
#include <string>

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kReadBytes = 1 << 16;  // as much as libarchive unpacks at once
constexpr std::size_t kLargestPlist = 16 << 20;
constexpr std::size_t kFirstValues = std::size_t{1} << 20;  // for which memory is allocated before any data has arrived

struct CloseProject {
  void operator()(archive* a) const { archive_read_free(a); }
};
using ProjectArchive = std::unique_ptr<archive, CloseProject>;

Error no_project(const fs::path& file) {
  return {ErrorCode::invalid_input,
          file.string() +
              " is not an InVesalius project (.inv3); give one, or a folder, zip or ISO image with a DICOM CT series"};
}

Error damaged(const fs::path& file, archive* a) {
  const char* reason = archive_error_string(a);
  return {ErrorCode::invalid_input, file.string() + " is truncated or damaged (" +
                                        (reason != nullptr ? reason : "unknown reason") + "); copy or export it again"};
}

// Walks to the entry whose name without folders is `name`. Null if the archive has no such entry.
Result<archive_entry*> find_entry(archive* a, const fs::path& file, const std::string& name) {
  archive_entry* entry = nullptr;
  bool any = false;
  for (;;) {
    const int status = archive_read_next_header(a, &entry);
    if (status == ARCHIVE_EOF) return nullptr;
    if (status != ARCHIVE_OK && status != ARCHIVE_WARN) {
      // A file that begins as a gzip archive, but has no valid entry, is damaged.
      if (any || archive_filter_code(a, 0) == ARCHIVE_FILTER_GZIP) return tl::unexpected(damaged(file, a));
      return tl::unexpected(no_project(file));
    }
    any = true;
    const char* path = archive_entry_pathname(entry);
    if (path != nullptr && fs::path(path).filename() == name) return entry;
  }
}

Result<ProjectArchive> open_archive(const fs::path& file) {
  ProjectArchive a(archive_read_new());
  archive_read_support_filter_gzip(a.get());
  archive_read_support_format_tar(a.get());
  if (archive_read_open_filename(a.get(), file.c_str(), kReadBytes) != ARCHIVE_OK)
    return tl::unexpected(no_project(file));
  return a;
}

struct Project {
  std::array<int, 3> dims{};
  Vec3 spacing_mm = Vec3::Zero();
  std::string matrix_name;
};

pugi::xml_node value_of(const pugi::xml_node& dict, const char* key) {
  for (const pugi::xml_node k : dict.children("key"))
    if (std::strcmp(k.text().get(), key) == 0) return k.next_sibling();
  return {};
}

Result<Project> parse_project(const std::string& text, const std::string& where) {
  pugi::xml_document document;
  const auto parsed = document.load_buffer(text.data(), text.size());
  if (!parsed)
    return failure(ErrorCode::invalid_input, where + " is not a property list (" + parsed.description() + ")");
  const pugi::xml_node top = document.child("plist").child("dict");
  const auto wrong = [&](const std::string& what) {
    return failure(ErrorCode::invalid_input, where + ": " + what + "; export the scan as DICOM instead");
  };

  const std::string modality = value_of(top, "modality").text().as_string("CT");
  if (modality != "CT")
    return failure(ErrorCode::unsupported, where + ": modality is " + modality + ", but only CT can be imported");
  const int orientation = value_of(top, "orientation").text().as_int(1);
  if (orientation != 1)
    return failure(ErrorCode::unsupported,
                   where + ": orientation is " + std::to_string(orientation) +
                       ", but only axial slices (1) can be imported; export the scan as DICOM instead");

  const pugi::xml_node matrix = value_of(top, "matrix");
  if (!matrix) return wrong("it has no matrix");
  const std::string dtype = value_of(matrix, "dtype").text().as_string();
  if (dtype != "int16") return wrong("matrix dtype is \"" + dtype + "\", not int16");
  Project project;
  project.matrix_name = fs::path(value_of(matrix, "filename").text().as_string()).filename().string();
  if (project.matrix_name.empty()) return wrong("matrix has no filename");

  int axis = 2;  // the shape counts slices, rows, columns
  for (const pugi::xml_node n : value_of(matrix, "shape").children()) {
    const int count = n.text().as_int();
    if (axis < 0 || count < 2 || count > imaging::kLargestScanAxis)
      return wrong("matrix shape must be three numbers from 2 to " + std::to_string(imaging::kLargestScanAxis));
    project.dims[static_cast<std::size_t>(axis--)] = count;
  }
  if (axis != -1)
    return wrong("matrix shape must be three numbers from 2 to " + std::to_string(imaging::kLargestScanAxis));

  int count = 0;
  for (const pugi::xml_node n : value_of(top, "spacing").children()) {
    const double mm = n.text().as_double();
    if (count > 2 || !(mm > 0.0) || mm > 100.0) return wrong("spacing must be three lengths above zero");
    project.spacing_mm[count++] = mm;
  }
  if (count != 3) return wrong("spacing must be three lengths above zero");
  return project;
}

Result<Project> read_project(const fs::path& file) {
  auto a = open_archive(file);
  if (!a) return tl::unexpected(a.error());
  const auto entry = find_entry(a->get(), file, "main.plist");
  if (!entry) return tl::unexpected(entry.error());
  if (*entry == nullptr)
    return failure(ErrorCode::invalid_input,
                   file.string() +
                       " is not an InVesalius project: it has no main.plist; give one, or a folder, "
                       "zip or ISO image with a DICOM CT series");
  std::string text;
  std::string chunk(1 << 16, '\0');
  for (;;) {
    const auto n = archive_read_data(a->get(), chunk.data(), chunk.size());
    if (n < 0) return tl::unexpected(damaged(file, a->get()));
    if (n == 0) break;
    text.append(chunk, 0, static_cast<std::size_t>(n));
    if (text.size() > kLargestPlist)
      return failure(ErrorCode::invalid_input,
                     file.string() + ": main.plist is far larger than a project's; export the scan as DICOM instead");
  }
  return parse_project(text, file.string() + ": main.plist");
}

}  // namespace

Result<CtScan> read_inv3(const fs::path& file, const KeepGoing& keep_going) try {
  std::error_code error;
  if (!fs::exists(file, error))
    return failure(ErrorCode::not_found,
                   "there is no file " + file.string() + "; give an InVesalius project or a DICOM folder");
  // Two passes, because the matrix may come before the list that gives its shape.
  const auto project = read_project(file);
  if (!project) return tl::unexpected(project.error());

  auto a = open_archive(file);
  if (!a) return tl::unexpected(a.error());
  const auto entry = find_entry(a->get(), file, project->matrix_name);
  if (!entry) return tl::unexpected(entry.error());
  if (*entry == nullptr)
    return failure(ErrorCode::invalid_input,
                   file.string() + " has no " + project->matrix_name + ", which its main.plist names; export it again");

  CtScan scan;
  imaging::HuVolume& volume = scan.volume;
  volume.dims = project->dims;
  volume.spacing_mm = project->spacing_mm;
  volume.directions = Vec3(1.0, -1.0, 1.0).asDiagonal();
  volume.origin_mm = Vec3(0.0, (volume.dims[1] - 1) * volume.spacing_mm.y(), 0.0);

  const std::size_t expected = volume.count() * sizeof(std::int16_t);
  if (archive_entry_size(*entry) != static_cast<std::int64_t>(expected))
    return failure(ErrorCode::invalid_input,
                   file.string() + ": " + project->matrix_name + " has " + std::to_string(archive_entry_size(*entry)) +
                       " bytes where the shape in main.plist needs " + std::to_string(expected) + "; export it again");
  // Memory grows with the bytes that arrive, not with the size that the file claims.
  std::size_t got = 0;
  while (got < expected) {
    if (!keep_going(static_cast<double>(got) / static_cast<double>(expected)))
      return stopped_while("reading " + file.string());
    std::size_t room = volume.values.size() * sizeof(std::int16_t);
    if (got == room) {
      volume.values.resize(std::min(volume.count(), std::max(kFirstValues, 2 * volume.values.size())));
      room = volume.values.size() * sizeof(std::int16_t);
    }
    auto* bytes = reinterpret_cast<char*>(volume.values.data());
    const auto n = archive_read_data(a->get(), bytes + got, std::min(kReadBytes, room - got));
    if (n <= 0) return tl::unexpected(damaged(file, a->get()));
    got += static_cast<std::size_t>(n);
  }
  scan.source = "InVesalius CT, " + imaging::describe(volume);
  return scan;
} catch (const std::bad_alloc&) {
  return failure(ErrorCode::exhausted,
                 file.string() + " takes more memory than this machine has; export thicker slices");
}

}  // namespace osteon::import
