#include "server/import/skipped_files.hpp"

#include <algorithm>
#include <optional>
#include <tuple>

namespace osteon::import {
namespace {

constexpr std::size_t kNames = 3;

struct Nouns {
  FileKind kind;
  const char* one;
  const char* many;
};
constexpr Nouns kNouns[] = {
    {FileKind::ct_slice, "CT slice", "CT slices"},
    {FileKind::index, "DICOMDIR", "DICOMDIRs"},
    {FileKind::localizer, "localizer", "localizers"},
    {FileKind::dose_report, "dose report", "dose reports"},
    {FileKind::report, "structured report", "structured reports"},
    {FileKind::secondary_capture, "secondary capture", "secondary captures"},
    {FileKind::segmentation, "segmentation", "segmentations"},
    {FileKind::registration, "registration", "registrations"},
    {FileKind::radiotherapy, "radiotherapy object", "radiotherapy objects"},
    {FileKind::presentation, "presentation state", "presentation states"},
    {FileKind::document, "document", "documents"},
    {FileKind::raw_data, "raw data set", "raw data sets"},
    {FileKind::unknown_syntax, "file of an unknown transfer syntax", "files of an unknown transfer syntax"},
    {FileKind::no_pixels, "CT image with no pixel data", "CT images with no pixel data"},
    {FileKind::copy, "copy of another file", "copies of other files"},
    {FileKind::damaged, "damaged file", "damaged files"},
    {FileKind::unreadable, "file that cannot be opened", "files that cannot be opened"},
    {FileKind::not_dicom, "file that is not DICOM", "files that are not DICOM"},
    {FileKind::empty, "empty file", "empty files"},
    {FileKind::archive, "archive inside", "archives inside"},
    {FileKind::link, "link", "links"},
    {FileKind::special, "pipe or device", "pipes or devices"},
    {FileKind::too_deep, "folder that lies too deep", "folders that lie too deep"},
};

bool keeps_names(FileKind kind) {
  return kind == FileKind::damaged || kind == FileKind::unreadable || kind == FileKind::no_pixels ||
         kind == FileKind::unknown_syntax;
}

// The first UTF-8 character of `text`, or nothing if there is none.
std::optional<std::pair<char32_t, std::size_t>> first_character(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  if (byte(0) < 0x80) return std::pair{static_cast<char32_t>(byte(0)), std::size_t{1}};
  const std::size_t size = byte(0) >= 0xf0 ? 4 : byte(0) >= 0xe0 ? 3 : 2;
  if (byte(0) < 0xc2 || byte(0) > 0xf4 || text.size() < size) return std::nullopt;
  char32_t code = byte(0) & (0x7fu >> size);
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return std::nullopt;
    code = code << 6 | (byte(i) & 0x3f);
  }
  constexpr char32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};
  if (code < kLeast[size] || code > 0x10ffff || (code >= 0xd800 && code < 0xe000)) return std::nullopt;
  return std::pair{code, size};
}

// Control characters of both sets, and marks that change the direction of the text after them.
bool is_control(char32_t code) {
  return code < 0x20 || (code >= 0x7f && code < 0xa0) || (code >= 0x200b && code < 0x2010) ||
         (code >= 0x2028 && code < 0x2030) || (code >= 0x2066 && code < 0x206a) || code == 0xfeff;
}

}  // namespace

std::string count_text(FileKind kind, const std::string& modality, int count) {
  const std::string number = count == 0 ? "" : std::to_string(count) + " ";
  if (kind == FileKind::other_modality) {
    if (modality.empty()) return number + (count == 1 ? "DICOM file" : "DICOM files") + " of unknown modality";
    return number + modality + (count == 1 ? " image" : " images");
  }
  const auto found = std::ranges::find(kNouns, kind, &Nouns::kind);
  return number + (count == 1 ? found->one : found->many);
}

SkippedFiles::Count& SkippedFiles::at(FileKind kind, const std::string& modality) {
  const auto key = [](const Count& c) { return std::tie(c.kind, c.modality); };
  const auto place = std::ranges::lower_bound(counts_, std::tie(kind, modality), {}, key);
  if (place != counts_.end() && place->kind == kind && place->modality == modality) return *place;
  return *counts_.insert(place, Count{kind, modality, 0, {}});
}

void SkippedFiles::add(FileKind kind, const std::string& name, const std::string& modality) {
  Count& c = at(kind, modality);
  ++c.count;
  if (keeps_names(kind) && c.names.size() < kNames) c.names.push_back(shown_text(name, 80));
}

void SkippedFiles::add(const SkippedFiles& other) {
  for (const Count& from : other.counts_) {
    Count& to = at(from.kind, from.modality);
    to.count += from.count;
    for (const std::string& name : from.names)
      if (to.names.size() < kNames) to.names.push_back(name);
  }
}

int SkippedFiles::count(FileKind kind) const {
  int sum = 0;
  for (const Count& c : counts_)
    if (c.kind == kind) sum += c.count;
  return sum;
}

std::string SkippedFiles::text(bool with_names) const {
  std::string text;
  for (const Count& c : counts_) {
    text += (text.empty() ? "" : ", ") + count_text(c.kind, c.modality, c.count);
    if (!with_names || c.names.empty()) continue;
    std::string names;
    for (const std::string& name : c.names) names += (names.empty() ? "" : ", ") + name;
    text += " (" + names + (c.count > static_cast<int>(c.names.size()) ? ", ..." : "") + ")";
  }
  return text;
}

std::string shown_text(std::string_view text, std::size_t most, bool latin1) {
  std::string shown;
  std::size_t characters = 0;
  while (!text.empty()) {
    if (characters++ == most) return shown + "...";
    const auto character = first_character(text);
    if (character) {
      if (is_control(character->first))
        shown += '?';
      else
        shown.append(text, 0, character->second);
      text.remove_prefix(character->second);
      continue;
    }
    const auto byte = static_cast<unsigned char>(text[0]);
    if (latin1 && byte >= 0xa0) {
      shown += static_cast<char>(0xc0 | byte >> 6);
      shown += static_cast<char>(0x80 | (byte & 0x3f));
    } else {
      shown += '?';
    }
    text.remove_prefix(1);
  }
  return shown;
}

}  // namespace osteon::import
