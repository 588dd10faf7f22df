#include "common/runtime/log.hpp"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <cstdio>

#include "common/core/bounded_text.hpp"

namespace osteon::log {
namespace {

// Quoted if a space or a quote would make the line ambiguous for a parser.
void append(std::string& line, const Field& field) {
  const std::string value = bounded_text(field.value);
  line += ' ';
  line += field.key;
  line += '=';
  if (value.find_first_of(" \"=") == std::string::npos && !value.empty()) {
    line += value;
    return;
  }
  line += '"';
  for (const char c : value) {
    if (c == '"' || c == '\\') line += '\\';
    line += c;
  }
  line += '"';
}

void write(spdlog::level::level_enum level, std::string_view event, std::initializer_list<Field> fields) {
  std::string line(event);
  for (const Field& field : fields) append(line, field);
  spdlog::log(level, "{}", line);
}

}  // namespace

Field::Field(std::string_view k, double v) : key(k), value(fmt::format("{:.6g}", v)) {}

void open(std::string_view program) {
  auto logger = spdlog::stderr_logger_mt(std::string(program));
  spdlog::set_default_logger(logger);
  spdlog::set_pattern("%Y-%m-%dT%H:%M:%S.%eZ %l %n %v", spdlog::pattern_time_type::utc);
  spdlog::flush_on(spdlog::level::info);
}

void info(std::string_view event, std::initializer_list<Field> fields) { write(spdlog::level::info, event, fields); }
void warn(std::string_view event, std::initializer_list<Field> fields) { write(spdlog::level::warn, event, fields); }
void error(std::string_view event, std::initializer_list<Field> fields) { write(spdlog::level::err, event, fields); }

int exit_with(std::string_view program, const Error& error) {
  std::fflush(stdout);
  std::fprintf(stderr, "%.*s: %s\n", static_cast<int>(program.size()), program.data(),
               bounded_text(error.message).c_str());
  return error.code == ErrorCode::cancelled ? 130 : 1;
}

}  // namespace osteon::log
