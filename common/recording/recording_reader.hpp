// Reads a recording of osteon-haptic --record, also while it grows or after its writer was killed.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/core/result.hpp"
#include "common/recording/hdf5_handle.hpp"
#include "common/recording/recording_layout.hpp"

namespace osteon {

// The first error stays. Values count only while ok().
class RecordingReader {
 public:
  explicit RecordingReader(const std::filesystem::path& file);

  // Opens the file, and checks that it is a recording of a version that is known.
  bool open();

  [[nodiscard]] bool has(const char* name, const char* group = ".") const;
  [[nodiscard]] bool has_dataset(const char* path) const;
  // Attributes of a group.
  [[nodiscard]] std::string text(const char* group, const char* name);
  [[nodiscard]] double number(const char* group, const char* name);
  [[nodiscard]] std::vector<std::string> texts(const char* path);       // a list of strings of one length
  [[nodiscard]] std::string digits(const char* path) const;             // a hash; empty if it is missing or was not set
  [[nodiscard]] std::size_t rows(const char* path = recording::kTime);  // complete rows: those that have their time
  // Rows of a dataset with `width` values in a row. Enumerations are read as integers of their size. T: double, float,
  // or an integer of 8, 32 or 64 bits without a sign, or of 64 bits with one.
  template <class T>
  [[nodiscard]] std::vector<T> values(const char* path, std::size_t rows, std::size_t width, std::size_t first = 0);
  // The value of a name in an enumeration.
  [[nodiscard]] std::optional<std::uint8_t> enumerator(const char* path, const char* name);

  // Keeps the first error. Both return false.
  bool wrong(ErrorCode code, const std::string& sentence);
  bool damaged(const char* what);
  [[nodiscard]] bool ok() const { return !error_; }
  [[nodiscard]] const Error& error() const { return *error_; }
  [[nodiscard]] const std::string& name() const { return name_; }  // "the recording FILE"

 private:
  bool open_file();
  [[nodiscard]] Hdf5Handle find(const char* group, const char* name);
  [[nodiscard]] Hdf5Handle find_dataset(const char* path);

  std::filesystem::path path_;
  std::string name_;
  Hdf5Handle file_;
  std::optional<Error> error_;
};

}  // namespace osteon
