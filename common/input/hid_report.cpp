#include "common/input/hid_report.hpp"

#include <algorithm>
#include <map>

namespace osteon {
namespace {

// Global items hold until they change. Local items end with each main item.
struct Globals {
  std::uint16_t page = 0;
  std::int32_t lowest = 0, highest = 0;
  std::uint32_t highest_unsigned = 0, bits = 0, count = 0;
  std::uint8_t report = 0;
};

struct Locals {
  std::vector<std::uint32_t> usages;
  std::uint32_t first = 0, last = 0;
  bool ranged = false;

  [[nodiscard]] std::optional<std::uint32_t> usage_of(std::uint32_t i) const {
    if (ranged) return std::min(first + i, last);
    if (usages.empty()) return std::nullopt;
    return usages[std::min<std::size_t>(i, usages.size() - 1)];
  }
};

std::int32_t sign_extended(std::uint32_t value, std::uint32_t bits) {
  if (bits == 0 || bits >= 32) return static_cast<std::int32_t>(value);
  const std::uint32_t sign = 1u << (bits - 1);
  return static_cast<std::int32_t>((value ^ sign) - sign);
}

// Tags with their type; the size bits are cleared.
enum Item : std::uint8_t {
  kInput = 0x80,
  kOutput = 0x90,
  kFeature = 0xb0,
  kCollection = 0xa0,
  kEndCollection = 0xc0,
  kUsagePage = 0x04,
  kLogicalMinimum = 0x14,
  kLogicalMaximum = 0x24,
  kReportSize = 0x74,
  kReportId = 0x84,
  kReportCount = 0x94,
  kPush = 0xa4,
  kPop = 0xb4,
  kUsage = 0x08,
  kUsageMinimum = 0x18,
  kUsageMaximum = 0x28,
  kLong = 0xfe,
};
constexpr std::uint32_t kConstant = 1, kVariable = 2;
constexpr std::uint32_t kMostFields = 1024, kMostBits = 1u << 16;

}  // namespace

std::optional<std::int32_t> HidField::value(std::span<const std::uint8_t> read) const noexcept {
  if (report != 0) {
    if (read.empty() || read[0] != report) return std::nullopt;
    read = read.subspan(1);
  }
  if (bits == 0 || bits > 32 || bit + bits > read.size() * 8) return std::nullopt;
  std::uint32_t raw = 0;
  for (std::uint32_t i = 0; i < bits; ++i)
    raw |= static_cast<std::uint32_t>((read[(bit + i) / 8] >> ((bit + i) % 8)) & 1) << i;
  return lowest < 0 ? sign_extended(raw, bits) : static_cast<std::int32_t>(raw);
}

std::optional<double> HidField::share(std::span<const std::uint8_t> read) const noexcept {
  const std::optional<std::int32_t> now = value(read);
  if (!now || highest <= lowest) return std::nullopt;
  const double range = static_cast<double>(highest) - lowest;
  return std::clamp((static_cast<double>(*now) - lowest) / range, 0.0, 1.0);
}

std::vector<HidField> hid_input_fields(std::span<const std::uint8_t> descriptor) {
  std::vector<HidField> fields;
  Globals globals;
  std::vector<Globals> stack;
  Locals locals;
  std::map<std::uint8_t, std::uint32_t> ends;  // end of each report's input, bits
  for (std::size_t at = 0; at < descriptor.size();) {
    const std::uint8_t prefix = descriptor[at++];
    if (prefix == kLong) {  // not used by standard devices; its size follows
      if (at >= descriptor.size()) break;
      at += 2u + descriptor[at];
      continue;
    }
    const std::size_t size = (prefix & 3) == 3 ? 4 : prefix & 3;
    if (at + size > descriptor.size()) break;
    std::uint32_t data = 0;
    for (std::size_t i = 0; i < size; ++i) data |= static_cast<std::uint32_t>(descriptor[at + i]) << (8 * i);
    at += size;
    const std::int32_t number = sign_extended(data, static_cast<std::uint32_t>(8 * size));

    switch (prefix & 0xfc) {
      case kUsagePage:
        globals.page = static_cast<std::uint16_t>(data);
        break;
      case kLogicalMinimum:
        globals.lowest = number;
        break;
      case kLogicalMaximum:
        globals.highest = number;
        globals.highest_unsigned = data;
        break;
      case kReportSize:
        globals.bits = data;
        break;
      case kReportCount:
        globals.count = data;
        break;
      case kReportId:
        globals.report = static_cast<std::uint8_t>(data);
        break;
      case kPush:
        stack.push_back(globals);
        break;
      case kPop:
        if (stack.empty()) return fields;
        globals = stack.back();
        stack.pop_back();
        break;
      // A usage of four bytes contains its own page.
      case kUsage:
        locals.usages.push_back(size == 4 ? data : std::uint32_t{globals.page} << 16 | data);
        break;
      case kUsageMinimum:
        locals.first = size == 4 ? data : std::uint32_t{globals.page} << 16 | data;
        locals.ranged = true;
        break;
      case kUsageMaximum:
        locals.last = size == 4 ? data : std::uint32_t{globals.page} << 16 | data;
        break;
      case kInput: {
        std::uint32_t& end = ends[globals.report];
        if (globals.count > kMostFields || globals.bits > 32 * 8 || end > kMostBits) return fields;
        for (std::uint32_t i = 0; i < globals.count; ++i, end += globals.bits) {
          const std::optional<std::uint32_t> usage = locals.usage_of(i);
          if ((data & kConstant) || !(data & kVariable) || !usage || globals.bits == 0 || globals.bits > 32) continue;
          HidField field{static_cast<std::uint16_t>(*usage >> 16),
                         static_cast<std::uint16_t>(*usage),
                         globals.report,
                         end,
                         globals.bits,
                         globals.lowest,
                         globals.highest};
          // "0 to 255" in one byte reads as −1. The maximum is not negative if the minimum is not.
          if (field.lowest >= 0 && field.highest < field.lowest)
            field.highest = static_cast<std::int32_t>(globals.highest_unsigned);
          fields.push_back(field);
          if (fields.size() >= kMostFields) return fields;
        }
        locals = {};
        break;
      }
      case kOutput:
      case kFeature:
      case kCollection:
      case kEndCollection:
        locals = {};
        break;
      default:
        break;
    }
  }
  return fields;
}

std::optional<HidField> find_field(std::span<const HidField> fields, std::span<const HidUsage> usages) {
  for (const HidUsage& wanted : usages)
    for (const HidField& field : fields)
      if (field.page == wanted.page && field.usage == wanted.usage) return field;
  return std::nullopt;
}

}  // namespace osteon
