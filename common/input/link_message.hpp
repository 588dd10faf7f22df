// Messages of a local link: the fields of a JSON object, each read with its range.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.hpp"
#include "common/geometry/pose.hpp"

namespace osteon {

inline constexpr int kLinkVersion = 3;
// Bytes. JSON writes a control character with six bytes. Even so, a message has room for three such texts beside all
// numbers, or for two and a wave.
inline constexpr std::size_t kMostLinkText = 512;

// What errors call the message and its two programs: "a pointer's", "the pointer", "osteon and osteon-haptic".
struct LinkMessageNames {
  const char *whose, *who, *programs;
};

// The part of a text that a reader takes. A message with a longer one would be refused as a whole.
[[nodiscard]] std::string shortened(const std::string& text);

// Reads the fields of one message. The first one that is wrong is the error; what follows is then of no use.
class LinkMessage {
 public:
  // Errors, invalid_input: too long, no JSON object, another version.
  [[nodiscard]] static Result<LinkMessage> read(std::string_view text, const LinkMessageNames& names);
  LinkMessage(LinkMessage&&) noexcept;
  LinkMessage& operator=(LinkMessage&&) noexcept;
  ~LinkMessage();

  double number(const char* name, double least, double most);
  bool boolean(const char* name);
  std::string text(const char* name);
  // Of fields that older programs do not send: none, false or empty without the field.
  std::optional<double> optional_number(const char* name, double least, double most);
  bool optional_boolean(const char* name);
  std::string optional_text(const char* name);
  // The index of a text that is one of these.
  std::size_t choice(const char* name, std::span<const std::string_view> choices);
  Vec3 vector(const char* name, double most);  // each coordinate from -most to most
  Eigen::Quaterniond rotation(const char* name);
  // At most so many integers, each from -most to most.
  std::vector<int> integers(const char* name, std::size_t most_count, int most);

  // Error, invalid_input: names the field.
  [[nodiscard]] Result<void> outcome() const;

 private:
  LinkMessage(std::unique_ptr<nlohmann::json> message, const LinkMessageNames& names);
  [[nodiscard]] const nlohmann::json* find(const char* name) const;
  void wrong(const char* name);
  // Writes `count` numbers to `values`.
  void array(const char* name, double most, double* values, std::size_t count);

  std::unique_ptr<nlohmann::json> message_;
  LinkMessageNames names_;
  std::string error_;
};

}  // namespace osteon
