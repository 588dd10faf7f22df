#include "common/input/link_message.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/input/local_link.hpp"

namespace osteon {

using nlohmann::json;

std::string shortened(const std::string& any) {
  // An invalid byte becomes a character of three bytes, so it is replaced before the size counts.
  const std::string text =
      json::parse(json(any).dump(-1, ' ', false, json::error_handler_t::replace)).get<std::string>();
  if (text.size() <= kMostLinkText) return text;
  std::size_t end = kMostLinkText;
  const auto within_character = [&] { return (static_cast<unsigned char>(text[end]) & 0xc0U) == 0x80U; };
  while (end > 0 && within_character()) --end;
  return text.substr(0, end);
}

LinkMessage::LinkMessage(std::unique_ptr<json> message, const LinkMessageNames& names)
    : message_(std::move(message)), names_(names) {}
LinkMessage::LinkMessage(LinkMessage&&) noexcept = default;
LinkMessage& LinkMessage::operator=(LinkMessage&&) noexcept = default;
LinkMessage::~LinkMessage() = default;

Result<LinkMessage> LinkMessage::read(std::string_view text, const LinkMessageNames& names) {
  const std::string whose = names.whose;
  if (text.size() > kMostLinkBytes) return failure(ErrorCode::invalid_input, whose + " message is too long");
  auto message = std::make_unique<json>(json::parse(text, nullptr, false));
  if (!message->is_object()) return failure(ErrorCode::invalid_input, whose + " message is no JSON object");
  const auto version = message->find("version");
  if (version == message->end() || !version->is_number_integer() || *version != kLinkVersion)
    return failure(ErrorCode::invalid_input,
                   std::string(names.who) + " speaks another version; install " + names.programs + " of one release");
  return LinkMessage(std::move(message), names);
}

Result<void> LinkMessage::outcome() const {
  if (error_.empty()) return {};
  return failure(ErrorCode::invalid_input, std::string(names_.whose) + " message has no usable \"" + error_ + '"');
}

double LinkMessage::number(const char* name, double least, double most) {
  const json* field = find(name);
  if (field == nullptr || !field->is_number()) return wrong(name), least;
  const double value = field->get<double>();
  if (!(value >= least && value <= most)) return wrong(name), least;
  return value;
}

bool LinkMessage::boolean(const char* name) {
  const json* field = find(name);
  if (field == nullptr || !field->is_boolean()) return wrong(name), false;
  return field->get<bool>();
}

std::optional<double> LinkMessage::optional_number(const char* name, double least, double most) {
  if (find(name) == nullptr) return std::nullopt;
  return number(name, least, most);
}

bool LinkMessage::optional_boolean(const char* name) { return find(name) != nullptr && boolean(name); }

std::string LinkMessage::optional_text(const char* name) { return find(name) == nullptr ? std::string() : text(name); }

std::string LinkMessage::text(const char* name) {
  const json* field = find(name);
  if (field == nullptr || !field->is_string()) return wrong(name), std::string();
  const auto& value = field->get_ref<const std::string&>();
  if (value.size() > kMostLinkText) return wrong(name), std::string();
  return value;
}

std::size_t LinkMessage::choice(const char* name, std::span<const std::string_view> choices) {
  const auto found = std::find(choices.begin(), choices.end(), text(name));
  if (found == choices.end()) return wrong(name), std::size_t{0};
  return static_cast<std::size_t>(found - choices.begin());
}

void LinkMessage::array(const char* name, double most, double* values, std::size_t count) {
  const json* field = find(name);
  if (field == nullptr || !field->is_array() || field->size() != count) return wrong(name);
  for (std::size_t i = 0; i < count; ++i) {
    const json& value = (*field)[i];
    if (!value.is_number()) return wrong(name);
    values[i] = value.get<double>();
    if (!(std::abs(values[i]) <= most)) return wrong(name);
  }
}

Vec3 LinkMessage::vector(const char* name, double most) {
  Vec3 values = Vec3::Zero();
  array(name, most, values.data(), 3);
  return values;
}

Eigen::Quaterniond LinkMessage::rotation(const char* name) {
  std::array<double, 4> q{};
  array(name, 1.0 + 1e-6, q.data(), q.size());
  const Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  if (!(std::abs(rotation.norm() - 1.0) < 1e-3)) return wrong(name), Eigen::Quaterniond::Identity();
  return rotation.normalized();
}

std::vector<int> LinkMessage::integers(const char* name, std::size_t most_count, int most) {
  std::vector<int> values;
  const json* field = find(name);
  if (field == nullptr || !field->is_array() || field->size() > most_count) return wrong(name), values;
  for (const json& value : *field) {
    // The range of a double first: a larger integer of JSON would be cut off.
    if (!value.is_number_integer() || !(std::abs(value.get<double>()) <= most)) return wrong(name), std::vector<int>();
    values.push_back(value.get<int>());
  }
  return values;
}

const json* LinkMessage::find(const char* name) const {
  const auto found = message_->find(name);
  return found == message_->end() ? nullptr : &*found;
}

void LinkMessage::wrong(const char* name) {
  if (error_.empty()) error_ = name;
}

}  // namespace osteon
