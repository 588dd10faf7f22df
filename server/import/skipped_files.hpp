// Files of an input besides CT slices, counted by kind.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace osteon::import {

enum class FileKind : std::uint8_t {
  ct_slice,
  index,  // DICOMDIR
  localizer,
  dose_report,
  report,  // structured, with other content
  secondary_capture,
  segmentation,
  registration,
  radiotherapy,
  presentation,
  document,
  raw_data,
  other_modality,  // named in the count
  unknown_syntax,  // a compression that the library does not know
  no_pixels,
  copy,
  damaged,
  unreadable,  // no permission, or the disk fails
  not_dicom,
  empty,
  archive,   // within a folder or another archive
  link,      // to a folder or to nothing; within an archive, any link
  special,   // pipes, sockets, devices
  too_deep,  // folders below the last level that is searched
};

// "3 localizers", "1 MR image"; only the noun for a count of zero.
[[nodiscard]] std::string count_text(FileKind kind, const std::string& modality, int count);

class SkippedFiles {
 public:
  // Stores the names of files that a person may want to inspect: damaged, unreadable, without pixels.
  void add(FileKind kind, const std::string& name, const std::string& modality = {});
  void add(const SkippedFiles& other);

  struct Count {
    FileKind kind;
    std::string modality;
    int count;
    std::vector<std::string> names;  // the first few
  };
  [[nodiscard]] const std::vector<Count>& counts() const { return counts_; }  // sorted by kind
  [[nodiscard]] int count(FileKind kind) const;
  [[nodiscard]] bool empty() const { return counts_.empty(); }
  // "1 DICOMDIR, 2 dose reports, 1 damaged file (a/b.dcm)"
  [[nodiscard]] std::string text(bool with_names = true) const;

 private:
  Count& at(FileKind kind, const std::string& modality);
  std::vector<Count> counts_;
};

// Text of a file in a form that may be shown: valid UTF-8 without control characters, cut to `most` characters.
// `latin1`: bytes that are not UTF-8 are ISO 8859-1.
[[nodiscard]] std::string shown_text(std::string_view text, std::size_t most, bool latin1 = false);

}  // namespace osteon::import
