// "pack" and "unpack": a case as one file.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "server/import/command.hpp"
#include "server/upload_validation/case_file.hpp"

namespace osteon::import {
namespace {

struct CaseFileArguments {
  std::string folder, file, out, library;
  bool replace = false;
};

std::string megabytes(const std::filesystem::path& file) {
  std::error_code ignored;
  const std::uint64_t bytes = std::filesystem::file_size(file, ignored);
  char text[32];
  std::snprintf(text, sizeof text, "%.1f MB", static_cast<double>(bytes) * 1e-6);
  return text;
}

Result<std::string> run_pack(const CaseFileArguments& a, const StopSignal& stop) {
  const std::filesystem::path file = a.file;
  if (!file.has_stem() || (file.extension() != kCaseFileEnding && file.extension() != ".zip"))
    return bad_input(a.file + " has no name of a case in one file; name it such as skull.osteon");
  Bar bar(stop, "packing");
  if (Result<void> packed = pack_case_file(a.folder, file, a.replace, bar.stage(0.0, 1.0)); !packed)
    return tl::unexpected(packed.error());
  return "file       " + a.file + ", " + megabytes(file) + "\n";
}

// The window reads the first line.
std::string folder_line(const std::filesystem::path& folder) { return "folder     " + folder.string() + "\n"; }

bool is_there(const std::filesystem::path& folder) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(folder / kCaseFiles[0], ignored);
}

Result<std::string> run_unpack(const CaseFileArguments& a, const StopSignal& stop) {
  std::filesystem::path out = a.out;
  Bar bar(stop, "unpacking");
  if (!a.library.empty()) {
    const auto folder = folder_of_case_file(a.library, a.file, bar.stage(0.0, 0.1));
    if (!folder) return tl::unexpected(folder.error());
    out = *folder;
    if (is_there(out)) return folder_line(out);
  }
  // This program also checks: see main().
  const auto checked =
      unpack_case_file("/proc/self/exe", a.file, out, case_file_quota(), bar.stage(a.library.empty() ? 0.0 : 0.1, 1.0));
  // Another process may have unpacked the same file meanwhile.
  if (!checked && !a.library.empty() && is_there(out)) return folder_line(out);
  if (!checked) return tl::unexpected(checked.error());
  return folder_line(out) + "title      " + checked->title + "\n" + "hash       " + to_hex(checked->hash) + "\n";
}

}  // namespace

void add_case_file_commands(CLI::App& app, std::vector<Command>& commands) {
  const auto shared = std::make_shared<CaseFileArguments>();  // by the options and the functions that run
  CaseFileArguments& a = *shared;
  CLI::App* pack = app.add_subcommand("pack", "Pack a case into one file, to send it or to open it by a double click");
  pack->add_option("CASE_DIR", a.folder, "Folder of the case")->required();
  pack->add_option("FILE", a.file, "File to write: NAME.osteon, a zip archive")->required();
  pack->add_flag("--replace", a.replace, "Write over a file that is there");
  commands.push_back({pack, [shared](const StopSignal& stop) { return run_pack(*shared, stop); }});

  CLI::App* unpack = app.add_subcommand("unpack", "Check a case in one file and make its folder");
  unpack->add_option("FILE", a.file, "NAME.osteon, as \"osteon-import pack\" writes it, or a zip archive of a case")
      ->required();
  CLI::Option* out = unpack->add_option("--out", a.out, "Folder of the case, made by this command");
  CLI::Option* into = unpack->add_option("--into", a.library,
                                         "Folder of many cases: this one goes into a folder named by the SHA-256 of "
                                         "FILE. One that is there is used again");
  out->excludes(into);
  commands.push_back({unpack, [shared](const StopSignal& stop) -> Result<std::string> {
                        if (shared->out.empty() && shared->library.empty())
                          return bad_input("unpack needs a place for the case; give --out FOLDER or --into FOLDER");
                        return run_unpack(*shared, stop);
                      }});
}

}  // namespace osteon::import
