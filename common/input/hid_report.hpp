// Where a HID device stores a value in its reports, according to its report descriptor (USB HID 1.11, section 6.2.2).
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace osteon {

struct HidField {
  std::uint16_t page = 0, usage = 0;
  std::uint8_t report = 0;  // report id; 0: the device does not number its reports
  std::uint32_t bit = 0;    // from the report's first byte, after the id if there is one
  std::uint32_t bits = 0;
  std::int32_t lowest = 0, highest = 0;

  // The value in a report as it was read, with its id if there is one. Nothing if it is another report or too short.
  [[nodiscard]] std::optional<std::int32_t> value(std::span<const std::uint8_t> read) const noexcept;
  // The same as a fraction of its range, 0 … 1.
  [[nodiscard]] std::optional<double> share(std::span<const std::uint8_t> read) const noexcept;
};

// Every variable input field of a descriptor. Nothing from parts that are damaged or unknown.
[[nodiscard]] std::vector<HidField> hid_input_fields(std::span<const std::uint8_t> descriptor);

// The field of the first of these usages that the device has, for example of an axis.
struct HidUsage {
  std::uint16_t page, usage;
};
[[nodiscard]] std::optional<HidField> find_field(std::span<const HidField> fields, std::span<const HidUsage> usages);

}  // namespace osteon
