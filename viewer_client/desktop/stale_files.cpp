#include "viewer_client/desktop/stale_files.hpp"

#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "viewer_client/desktop/library.hpp"

namespace osteon {

namespace {

constexpr std::string_view kPartialMark = ".partial-", kUnsentMark = ".unsent-", kSocketBegin = "osteon-",
                           kLogEnding = ".log";

// The number at the end of a name, if the program with this number has ended.
bool ends_with_a_dead_program(std::string_view name) {
  const std::size_t begin = name.find_last_not_of("0123456789") + 1;
  constexpr std::size_t kMostDigits = 9;
  if (begin == name.size() || name.size() - begin > kMostDigits) return false;
  const auto pid = static_cast<pid_t>(std::stol(std::string(name.substr(begin))));
  return pid > 0 && ::kill(pid, 0) != 0 && errno == ESRCH;
}

template <class Goes>
void remove_from(const std::filesystem::path& folder, Goes goes) {
  std::vector<std::filesystem::directory_entry> all;
  std::error_code ignored;
  for (std::filesystem::directory_iterator at(folder, ignored), end; !ignored && at != end; at.increment(ignored))
    all.push_back(*at);
  for (const auto& entry : all)
    if (goes(entry)) std::filesystem::remove_all(entry.path(), ignored);
}

}  // namespace

StaleFiles::StaleFiles(std::filesystem::path sockets) : sockets_(std::move(sockets)) {
  std::error_code ignored;
  std::filesystem::create_directories(data_folder(), ignored);
  windows_ = std::make_unique<FileLock>(data_folder() / "windows.lock");
  if (windows_->try_alone()) remove();
  windows_->wait_shared();
}

StaleFiles::~StaleFiles() {
  if (windows_->try_alone()) remove();
}

// Only while no other window is there: one that has just unpacked a file has no session yet.
void StaleFiles::remove() {
  std::set<std::filesystem::path> needed;
  for (const std::filesystem::path& bone : remembered_bones()) needed.insert(bone.filename());
  remove_from(cases_folder(), [&](const std::filesystem::directory_entry& entry) {
    std::error_code ignored;
    const std::string name = entry.path().filename().string();
    if (name.find(kPartialMark) != std::string::npos) return ends_with_a_dead_program(name);
    if (entry.is_regular_file(ignored))
      return entry.path().extension() == kLogEnding && ends_with_a_dead_program(entry.path().stem().string());
    // Without any session the settings may be lost, and not the sessions.
    return is_name_of_unpacked(name) && !needed.empty() && !needed.contains(name);
  });
  // A case may have such a name too. Only a mark is a file, and it begins with the name of its case.
  remove_from(cases_folder(), [](const std::filesystem::directory_entry& entry) {
    std::error_code ignored;
    const std::string name = entry.path().filename().string();
    const std::size_t mark = name.rfind(kUnsentMark);
    if (mark == std::string::npos || mark == 0 || !entry.is_regular_file(ignored)) return false;
    if (!ends_with_a_dead_program(name)) return false;
    remove_unused_case(cases_folder() / name.substr(0, mark));
    return true;
  });
  remove_from(sockets_, [](const std::filesystem::directory_entry& entry) {
    std::error_code ignored;
    const std::string name = entry.path().filename().string();
    return name.starts_with(kSocketBegin) && entry.is_socket(ignored) && ends_with_a_dead_program(name);
  });
}

void remove_partials(const std::filesystem::path& path) {
  const std::string begin = path.filename().string() + std::string(kPartialMark);
  remove_from(path.parent_path(), [&](const std::filesystem::directory_entry& entry) {
    const std::string name = entry.path().filename().string();
    return name.starts_with(begin) && ends_with_a_dead_program(name);
  });
}

std::filesystem::path socket_path(const std::filesystem::path& sockets, const char* use) {
  return sockets / (std::string(kSocketBegin) + use + "-" + std::to_string(::getpid()));
}

}  // namespace osteon
