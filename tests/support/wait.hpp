// Waits in tests for the actions of another process. Polls until a deadline; never a fixed sleep.
#pragma once
#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

namespace osteon::test {

// A patience as the build needs it: five times as long under a sanitizer. The functions below use it by themselves.
[[nodiscard]] std::chrono::milliseconds stretched(std::chrono::milliseconds patience);

// True as soon as `condition` holds. False if it does not hold within `patience`.
[[nodiscard]] bool wait_until(const std::function<bool()>& condition, std::chrono::milliseconds patience);

// Waits until the file exists and is not empty.
[[nodiscard]] bool wait_for_file(const std::filesystem::path& file, std::chrono::milliseconds patience);

// The first line of a server's address file, e.g. "127.0.0.1:40123".
[[nodiscard]] std::optional<std::string> wait_for_address(const std::filesystem::path& file,
                                                          std::chrono::milliseconds patience);

}  // namespace osteon::test
