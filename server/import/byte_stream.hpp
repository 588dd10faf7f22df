// Values as bytes, for a pipe between two processes of one program.
#pragma once
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace osteon::import {

class ByteWriter {
 public:
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void add(const T& value) { bytes_.append(reinterpret_cast<const char*>(&value), sizeof value); }
  void add(const std::string& text) {
    add(text.size());
    bytes_ += text;
  }
  void add(const std::vector<double>& values) {
    add(values.size());
    for (const double value : values) add(value);
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

// Reads values in the order in which they were written. Once bytes are missing, every further read fails.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}

  template <class T>
  requires std::is_trivially_copyable_v<T>
  bool get(T& value) {
    if (bytes_.size() < sizeof value) return fail();
    std::memcpy(&value, bytes_.data(), sizeof value);
    bytes_.remove_prefix(sizeof value);
    return ok_;
  }
  bool get(std::string& text) {
    std::size_t size = 0;
    if (!get(size) || size > bytes_.size()) return fail();
    text = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return ok_;
  }
  bool get(std::vector<double>& values) {
    std::size_t size = 0;
    if (!get(size) || size > bytes_.size() / sizeof(double)) return fail();
    values.resize(size);
    for (double& value : values) get(value);
    return ok_;
  }
  [[nodiscard]] std::string_view rest() const { return bytes_; }

 private:
  bool fail() {
    bytes_ = {};
    return ok_ = false;
  }
  std::string_view bytes_;
  bool ok_ = true;
};

}  // namespace osteon::import
