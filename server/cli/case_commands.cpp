#include "server/cli/case_commands.hpp"

#include <CLI/CLI.hpp>

#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "common/runtime/progress.hpp"
#include "server/cli/asking.hpp"
#include "server/upload_validation/case_archive.hpp"
#include "server/upload_validation/case_check.hpp"

namespace osteon {
namespace {

namespace fs = std::filesystem;

void print_case(const wire::StoredCaseLine& one) {
  std::printf("%s  %8.1f MB  [%s]%s\n", to_hex(one.hash).c_str(), static_cast<double>(one.bytes) / 1e6,
              one.title.c_str(), one.known ? "  was here before" : "");
}

Result<void> list_cases(RoomAdminClient& client) {
  const auto all = client.cases();
  if (!all) return tl::unexpected(all.error());
  for (const wire::StoredCaseLine& one : *all) print_case(one);
  return {};
}

// A folder is packed first, into a temporary file.
Result<void> upload(RoomAdminClient& client, const fs::path& from) {
  fs::path archive = from;
  std::error_code error;
  struct Packed {
    fs::path folder;
    ~Packed() {
      std::error_code ignored;
      if (!folder.empty()) fs::remove_all(folder, ignored);
    }
  } packed;
  if (fs::is_directory(from, error)) {
    std::string place = (fs::temp_directory_path() / "osteon-upload-XXXXXX").string();
    if (::mkdtemp(place.data()) == nullptr)
      return failure(ErrorCode::internal, "cannot make a folder for the archive in " + place);
    packed.folder = place;
    archive = packed.folder / "case.zip";
    if (Result<void> done = pack_case(from, archive); !done) return done;
  }
  Progress progress("upload");
  const auto stored = client.upload_case(archive, [&](double fraction) {
    progress.update(fraction);
    return true;
  });
  if (!stored) return tl::unexpected(stored.error());
  print_case(*stored);
  return {};
}

}  // namespace

void add_case_commands(CLI::App& app, std::function<Result<void>()>& chosen) {
  CLI::App* cases = app.add_subcommand("cases", "The cases of a server that runs: lists them, uploads one");
  cases->require_subcommand(1);
  add_asking_command(*cases, "list", "Lists them all", chosen, list_cases);
  const auto from = std::make_shared<fs::path>();  // shared by the option and the function that runs
  add_asking_command(*cases, "upload", "Sends a case to the server, which checks and stores it", chosen,
                     [from](RoomAdminClient& client) { return upload(client, *from); })
      ->add_option("case", *from, "Folder of a case, as osteon-import writes it, or a zip archive of one")
      ->required();
}

void case_check_command(int argc, char** argv) {
  if (argc == 5 && std::strcmp(argv[1], "check-case") == 0) run_case_check(argv[2], argv[3], argv[4]);
}

}  // namespace osteon
