#include "server/import/numbered_files.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <system_error>

namespace osteon::import {
namespace {

namespace fs = std::filesystem;

struct Numbered {
  std::int64_t number = 0;
  fs::path file;
  std::string stem;  // the name before the number
};

bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

std::string lower_extension(const fs::path& file) {
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

// False if the name does not end in a number that fits.
bool read_number_of(const fs::path& file, Numbered& slice) {
  const std::string extension = file.extension().string();
  const bool is_number = extension.size() > 1 && std::ranges::all_of(extension.substr(1), is_digit);
  const std::string name = is_number ? file.filename().string() : file.stem().string();
  std::size_t digits = name.size();
  while (digits > 0 && is_digit(name[digits - 1])) --digits;
  slice.file = file;
  slice.stem = name.substr(0, digits);
  const auto parsed = std::from_chars(name.data() + digits, name.data() + name.size(), slice.number);
  return digits < name.size() && parsed.ec == std::errc{};
}

}  // namespace

Result<std::vector<fs::path>> numbered_files(const fs::path& folder, std::string_view extension,
                                             const std::string& wanted) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    return failure(ErrorCode::not_found, "there is no folder " + folder.string() + "; give one with " + wanted);
  std::vector<Numbered> slices;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (!extension.empty() && lower_extension(entry.path()) != extension) continue;
    Numbered slice;
    if (!read_number_of(entry.path(), slice)) {
      if (extension.empty()) continue;
      return failure(
          ErrorCode::invalid_input,
          entry.path().string() + " has no slice number at the end of its name; number the slices or move it away");
    }
    if (!slices.empty() && slice.stem != slices.front().stem)
      return failure(ErrorCode::invalid_input, folder.string() + " holds more than one stack (" + slice.stem +
                                                   "... and " + slices.front().stem + "...); give a folder with one");
    slices.push_back(std::move(slice));
  }
  if (error) return failure(ErrorCode::not_found, "cannot read the folder " + folder.string() + ": " + error.message());
  if (slices.empty())
    return failure(ErrorCode::invalid_input,
                   folder.string() + (extension == ".png" ? " has no PNG files" : " has no numbered files") +
                       "; give a folder with " + wanted);
  std::ranges::sort(slices, {}, &Numbered::number);
  for (std::size_t i = 1; i < slices.size(); ++i) {
    if (slices[i].number == slices[i - 1].number)
      return failure(ErrorCode::invalid_input, slices[i].file.string() + " has the same slice number as " +
                                                   slices[i - 1].file.filename().string() + "; keep one of them");
    if (slices[i].number != slices[i - 1].number + 1)
      return failure(ErrorCode::invalid_input, folder.string() + ": slice " + std::to_string(slices[i - 1].number + 1) +
                                                   " is missing, after " + slices[i - 1].file.filename().string() +
                                                   "; copy the whole stack");
  }
  std::vector<fs::path> files;
  for (Numbered& slice : slices) files.push_back(std::move(slice.file));
  return files;
}

}  // namespace osteon::import
