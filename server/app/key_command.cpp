#include "server/app/key_command.hpp"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <filesystem>
#include <memory>

#include "server/journal/signing.hpp"

namespace osteon {
namespace {

struct Arguments {
  std::filesystem::path file;
};

void print(const SigningKeys& keys) {
  std::printf("%s\n", to_hex(keys.key().public_key()).c_str());
  // Standard output has the key alone, for programs.
  for (const Succession& one : keys.successions())
    std::fprintf(stderr, "earlier: %s\n", to_hex(one.before).c_str());
}

Result<void> show(const Arguments& given) {
  return load_signing_keys(given.file).map([](const auto& keys) { print(*keys); });
}

Result<void> rotate(const Arguments& given) {
  return rotate_signing_keys(given.file).map([](const auto& keys) {
    print(*keys);
    std::fprintf(stderr, "A server that runs signs with the earlier key until it is started again.\n");
  });
}

}  // namespace

void add_key_command(CLI::App& app, std::function<Result<void>()>& chosen) {
  const auto given = std::make_shared<Arguments>();  // shared by the options and by what runs
  CLI::App* key = app.add_subcommand("key", "Shows or changes the key with which a server signs its journals");
  key->require_subcommand(1);
  const auto command = [&](const char* name, const char* what, Result<void> (*run)(const Arguments&)) {
    CLI::App* sub = key->add_subcommand(name, what);
    sub->add_option("file", given->file, "The signing key, which the server made at its first start")->required();
    sub->callback([&chosen, given, run] { chosen = [given, run] { return run(*given); }; });
  };
  command("show", "Prints the public key, by which \"verify --key\" knows the server's signatures", show);
  command("rotate", "Makes a new key, which the present one signs; prints its public key", rotate);
}

}  // namespace osteon
