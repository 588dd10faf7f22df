#include "common/runtime/command_line.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <csignal>
#include <memory>

#include "common/runtime/log.hpp"

namespace osteon {
namespace {

constexpr std::size_t kNameColumns = 26;  // of an option's or command's name, before its description

// CLI11 2.1 does not break long lines.
class Help final : public CLI::Formatter {
 public:
  std::string make_option(const CLI::Option* option, bool is_positional) const override {
    return item(make_option_name(option, is_positional) + make_option_opts(option), make_option_desc(option));
  }
  std::string make_subcommand(const CLI::App* command) const override {
    return item(command->get_display_name(true), command->get_description());
  }
  std::string make_description(const CLI::App* app) const override {
    return wrapped(CLI::Formatter::make_description(app), kHelpColumns, 0, 0);
  }

 private:
  static std::string item(const std::string& name, const std::string& description) {
    std::string text = wrapped("  " + name, kHelpColumns, 6, 0);
    if (text.size() >= kNameColumns) text += "\n";
    const std::size_t used = text.size() >= kNameColumns ? 0 : text.size();
    return text + std::string(kNameColumns - used, ' ') +
           wrapped(description, kHelpColumns, kNameColumns, kNameColumns) + "\n";
  }
};

void use_help(CLI::App& app, const std::shared_ptr<Help>& help) {
  app.formatter(help);
  for (CLI::App* command : app.get_subcommands({})) use_help(*command, help);
}

}  // namespace

std::string wrapped(std::string_view text, std::size_t columns, std::size_t indent, std::size_t used) {
  const auto width = [](std::string_view word) {
    // Bytes that begin a character of UTF-8.
    return static_cast<std::size_t>(std::ranges::count_if(word, [](char c) { return (c & 0xC0) != 0x80; }));
  };
  std::string lines;
  std::size_t at = used;
  bool begins = true;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of(" \n"), text.size());
    const std::string_view word = text.substr(0, end);
    if (!begins && at + 1 + width(word) > columns) {
      lines += "\n" + std::string(indent, ' ');
      at = indent;
      begins = true;
    }
    if (!begins) lines += ' ';
    at += width(word) + (begins ? 0 : 1);
    lines += word;
    begins = false;
    if (end < text.size() && text[end] == '\n') {
      lines += "\n" + std::string(indent, ' ');
      at = indent;
      begins = true;
    }
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

std::optional<int> parse_arguments(CLI::App& app, int argc, const char* const* argv) {
  app.set_version_flag("--version", app.get_name() + " " OSTEON_VERSION, "Print the version and exit");
  use_help(app, std::make_shared<Help>());
  // Beyond a limit of the shell, a write then fails like one to a full disk, and the program says so.
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    app.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    // A command has a help of its own.
    const CLI::App* given = &app;
    std::string path = app.get_name();
    while (!given->get_subcommands().empty()) {
      given = given->get_subcommands().front();
      path += " " + given->get_name();
    }
    // The library treats help as an "error" of code 0.
    if (error.get_exit_code() == 0) return app.exit(error);
    return log::exit_with(app.get_name(),
                          {ErrorCode::invalid_input, std::string(error.what()) + "; see " + path + " --help"});
  }
}

}  // namespace osteon
