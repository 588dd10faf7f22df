#include "server/cli/key_command.hpp"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <filesystem>
#include <memory>

#include "common/runtime/files.hpp"
#include "server/cli/audit_commands.hpp"

namespace osteon {
namespace {

struct KeyArguments {
  std::filesystem::path file;
};

void print_keys(const SigningKeys& keys) {
  std::printf("%s\n", to_hex(keys.key().public_key()).c_str());
  // Standard output has the key alone, for programs.
  for (const Succession& one : keys.successions()) std::fprintf(stderr, "earlier: %s\n", to_hex(one.before).c_str());
}

Result<void> show_keys(const KeyArguments& given) {
  return load_signing_keys(given.file).map([](const auto& keys) { print_keys(*keys); });
}

Result<void> rotate(const KeyArguments& given) {
  const AuditEvent event{.action = "key-rotate", .object = given.file.filename().string(), .result = kOk};
  return run_audited(given.file, given.file, event, [&] {
    return rotate_signing_keys(given.file).map([](const auto& keys) {
      print_keys(*keys);
      std::fprintf(stderr, "A server that runs signs with the earlier key until it is started again.\n");
    });
  });
}

}  // namespace

Result<PublicKey> public_key_of(const std::string& given) {
  if (Result<PublicKey> key = parse_public_key(given)) return key;
  std::error_code ignored;
  if (!std::filesystem::exists(given, ignored))
    return failure(ErrorCode::not_found, "--key " + given +
                                             " is neither 64 hexadecimal digits nor a file; give what "
                                             "osteon-server key show prints");
  if (const auto keys = load_signing_keys(given)) return (*keys)->key().public_key();
  const Result<std::string> content = read_file(given);
  if (!content) return tl::unexpected(content.error());
  return parse_public_key(*content).map_error([&](Error error) {
    error.message = "--key " + given + ": " + error.message;
    return error;
  });
}

void add_key_command(CLI::App& app, std::function<Result<void>()>& chosen) {
  const auto given = std::make_shared<KeyArguments>();  // shared by the options and the function that runs
  CLI::App* key = app.add_subcommand("key", "Shows or changes the key with which a server signs its journals");
  key->require_subcommand(1);
  const auto command = [&](const char* name, const char* what, Result<void> (*run)(const KeyArguments&)) {
    CLI::App* sub = key->add_subcommand(name, what);
    sub->add_option("file", given->file, "The signing key, which the server made at its first start")->required();
    sub->callback([&chosen, given, run] { chosen = [given, run] { return run(*given); }; });
  };
  command("show", "Prints the public key, by which \"verify --key\" knows the server's signatures", show_keys);
  command("rotate", "Makes a new key, which the present one signs; prints its public key", rotate);
}

}  // namespace osteon
