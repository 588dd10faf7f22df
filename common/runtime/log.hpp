// Structured log lines on standard error: time, level, program, event, then key=value fields. Not for real-time
// threads, which count and report through their statistics instead.
#pragma once
#include <concepts>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>

#include "common/core/result.hpp"

namespace osteon::log {

struct Field {
  std::string_view key;
  std::string value;
  Field(std::string_view k, std::string v) : key(k), value(std::move(v)) {}
  Field(std::string_view k, std::string_view v) : key(k), value(v) {}
  Field(std::string_view k, const char* v) : key(k), value(v) {}
  Field(std::string_view k, bool v) : key(k), value(v ? "true" : "false") {}
  Field(std::string_view k, double v);
  template <std::integral T>
  Field(std::string_view k, T v) : key(k), value(std::to_string(v)) {}
};

void open(std::string_view program);  // once, at the start of main
void info(std::string_view event, std::initializer_list<Field> fields = {});
void warn(std::string_view event, std::initializer_list<Field> fields = {});
void error(std::string_view event, std::initializer_list<Field> fields = {});

// Prints the sentence "PROGRAM: message" to standard error. Returns the exit code for main: 130 for a cancelled run, 1
// otherwise.
[[nodiscard]] int exit_with(std::string_view program, const Error& error);

}  // namespace osteon::log
