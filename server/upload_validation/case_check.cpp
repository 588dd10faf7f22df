#include "server/upload_validation/case_check.hpp"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <thread>
#include <utility>

#include "common/core/bounded_text.hpp"
#include "common/runtime/log.hpp"
#include "common/volume/case.hpp"
#include "common/volume/case_scan.hpp"
#include "server/upload_validation/confine.hpp"

extern char** environ;

namespace osteon {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostSaid = 64 * 1024;
// Allocators and threads reserve addresses that they do not use.
[[maybe_unused]] constexpr std::uint64_t kAddressesToMemory = 4;

tl::unexpected<Error> cannot_start(int reason) {
  return failure(ErrorCode::internal,
                 std::string("the process that checks cases cannot be started: ") + std::strerror(reason));
}

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int number() const { return number_; }
  void close() {
    ::close(number_);
    number_ = -1;
  }

 private:
  int number_;
};

// A child process. The destructor ends it.
class Child {
 public:
  explicit Child(pid_t id) : id_(id) {}
  ~Child() { (void)end(); }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  int end() {
    if (id_ == 0) return status_;
    ::kill(id_, SIGKILL);
    while (::waitpid(id_, &status_, 0) < 0 && errno == EINTR) {
    }
    id_ = 0;
    return status_;
  }
  // For a child that has sent its whole answer: waits a moment for it to end.
  int join(Clock::time_point until) {
    while (id_ != 0 && ::waitpid(id_, &status_, WNOHANG) == 0) {
      if (Clock::now() > until) return end();
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    id_ = 0;
    return status_;
  }
  void limit(int resource, std::uint64_t most) const {
    const rlimit limit{most, most};
    ::prlimit(id_, static_cast<__rlimit_resource>(resource), &limit, nullptr);
  }

 private:
  pid_t id_;
  int status_ = 0;
};

// The child's whole answer. Nothing if it is too long, takes too long or is no longer wanted.
std::optional<std::string> listen(int descriptor, Clock::time_point until, const std::function<bool()>& stop) {
  std::string said;
  std::array<char, 4096> piece{};
  while (said.size() <= kMostSaid) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - Clock::now());
    if (left.count() <= 0 || (stop && stop())) return {};
    pollfd ready{descriptor, POLLIN, 0};
    if (::poll(&ready, 1, static_cast<int>(std::min<std::int64_t>(left.count(), 1000))) <= 0) continue;
    const ssize_t n = ::read(descriptor, piece.data(), piece.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return said;
    said.append(piece.data(), static_cast<std::size_t>(n));
  }
  return {};
}

void limit_self(__rlimit_resource resource, std::uint64_t most) {
  const rlimit limit{most, most};
  ::setrlimit(resource, &limit);
}

// The quota as an argument of the process.
std::string text_of(const UploadQuota& quota) {
  return nlohmann::json{{"archive_bytes", quota.archive_bytes},
                        {"unpacked_bytes", quota.unpacked_bytes},
                        {"entries", quota.entries},
                        {"ratio", quota.ratio},
                        {"ratio_free_bytes", quota.ratio_free_bytes}}
      .dump();
}
UploadQuota quota_of(const std::string& text) {
  const nlohmann::json said = nlohmann::json::parse(text);
  UploadQuota quota;
  said.at("archive_bytes").get_to(quota.archive_bytes);
  said.at("unpacked_bytes").get_to(quota.unpacked_bytes);
  said.at("entries").get_to(quota.entries);
  said.at("ratio").get_to(quota.ratio);
  said.at("ratio_free_bytes").get_to(quota.ratio_free_bytes);
  return quota;
}

// Names the kind of error in the answer of the process.
const char* word_of(ErrorCode code) {
  if (code == ErrorCode::exhausted) return "exhausted";
  return code == ErrorCode::internal ? "internal" : "invalid";
}
ErrorCode code_of(const nlohmann::json& answer) {
  const std::string word =
      answer.contains("code") && answer["code"].is_string() ? answer["code"].get<std::string>() : "";
  if (word == "exhausted") return ErrorCode::exhausted;
  return word == "internal" ? ErrorCode::internal : ErrorCode::invalid_input;
}

// Reports only once, not for every case, that the kernel cannot confine the process fully.
void say_what_holds(const nlohmann::json& answer) {
  const auto holds = [&](const char* what) { return answer.contains(what) && answer[what] == true; };
  if (holds("files_held") && holds("calls_held")) return;
  static std::atomic<bool> said{false};
  if (!said.exchange(true))
    log::warn("cases are checked in a process that this system cannot confine fully",
              {{"files_held", holds("files_held")}, {"calls_held", holds("calls_held")}});
}

bool has_plain_files(const fs::path& folder) {
  std::set<std::string> names;
  std::error_code error;
  if (fs::symlink_status(folder, error).type() != fs::file_type::directory) return false;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const bool known = std::ranges::find(kCaseFiles, entry.path().filename().string()) != std::end(kCaseFiles);
    if (!known || entry.symlink_status(error).type() != fs::file_type::regular || error) return false;
    names.insert(entry.path().filename().string());
  }
  return !error && std::ranges::all_of(std::span(kCaseFiles).first(kNeededCaseFiles),
                                       [&](std::string_view needed) { return names.contains(std::string(needed)); });
}

// Writes the files of the case while it is unpacked.
class Files {
 public:
  explicit Files(fs::path folder) : folder_(std::move(folder)) {}
  Result<void> put(std::string_view file, std::span<const std::byte> piece) {
    if (file != name_) {
      out_ = std::ofstream(folder_ / file, std::ios::binary | std::ios::trunc);
      name_ = file;
    }
    out_.write(reinterpret_cast<const char*>(piece.data()), static_cast<std::streamsize>(piece.size()));
    return out_ ? Result<void>{} : no_space(file);
  }
  Result<void> close() {
    out_.close();
    return out_ ? Result<void>{} : no_space(name_);
  }

 private:
  static Result<void> no_space(std::string_view file) {
    return failure(ErrorCode::internal,
                   "cannot unpack " + std::string(file) + ": the disk accepts no more data; make room on it");
  }
  const fs::path folder_;
  std::string name_;
  std::ofstream out_;
};

struct SentCase {
  Case bone;
  std::optional<CaseScan> scan;  // if it was sent
};

Error not_sound(const Error& error) {
  return error.code == ErrorCode::exhausted
             ? error
             : Error{ErrorCode::invalid_input, "the case is not sound: " + error.message};
}

// [the process]
Result<SentCase> unpack_and_read(const fs::path& archive, const fs::path& sent, const UploadQuota& quota) {
  std::error_code error;
  fs::create_directory(sent, error);
  if (error) return failure(ErrorCode::internal, "cannot unpack the case: " + error.message());
  Files files(sent);
  const auto put = [&](std::string_view file, std::span<const std::byte> piece) { return files.put(file, piece); };
  const auto unpacked = unpack_case(archive, quota, put);
  if (!unpacked) return tl::unexpected(unpacked.error());
  if (const Result<void> closed = files.close(); !closed) return tl::unexpected(closed.error());
  Result<Case> bone = Case::load(sent);
  if (!bone) return tl::unexpected(not_sound(bone.error()));
  if (!unpacked->contains(kScanFile)) return SentCase{std::move(*bone), std::nullopt};
  Result<CaseScan> scan = load_scan(sent, *bone);
  if (!scan) return tl::unexpected(not_sound(scan.error()));
  return SentCase{std::move(*bone), std::move(*scan)};
}

Result<void> write_again(const SentCase& sent, const fs::path& folder) {
  return sent.scan ? sent.bone.save(folder, *sent.scan) : sent.bone.save(folder);
}

}  // namespace

Result<CheckedCase> check_case(const fs::path& program, const fs::path& archive, const fs::path& folder,
                               const UploadQuota& quota, const std::function<bool()>& stop) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return cannot_start(errno);
  Descriptor in(ends[0]), out(ends[1]);
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_adddup2(&actions, out.number(), STDOUT_FILENO);
  ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  std::array<std::string, 5> words{program.string(), "check-case", archive.string(), folder.string(), text_of(quota)};
  std::array<char*, 6> arguments{words[0].data(), words[1].data(), words[2].data(),
                                 words[3].data(), words[4].data(), nullptr};
  pid_t id = 0;
  const int failed = ::posix_spawn(&id, words[0].c_str(), &actions, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return cannot_start(failed);
  Child child(id);
  out.close();
  // The limits apply before the process has read any of the case, or nearly. Whatever it does until then, it may do
  // anyway.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // sanitizers reserve far more than they use
  child.limit(RLIMIT_DATA, quota.memory_bytes);
  child.limit(RLIMIT_AS, kAddressesToMemory * quota.memory_bytes);
#endif
  child.limit(RLIMIT_FSIZE, quota.unpacked_bytes);
  child.limit(RLIMIT_CPU, static_cast<std::uint64_t>(2 * quota.time.count()));

  const std::optional<std::string> said = listen(in.number(), Clock::now() + quota.time, stop);
  if (!said) {
    (void)child.end();
    if (stop && stop()) return failure(ErrorCode::cancelled, "the check of the case was cancelled");
    return failure(ErrorCode::exhausted,
                   "reading the case takes longer than the allowed " + std::to_string(quota.time.count()) + " s");
  }
  const int status = child.join(Clock::now() + std::chrono::seconds(5));
  const nlohmann::json answer = nlohmann::json::parse(*said, nullptr, false);
  if (answer.is_object()) say_what_holds(answer);
  if (answer.is_object() && answer.contains("error") && answer["error"].is_string())
    return failure(code_of(answer), answer["error"].get<std::string>());
  const bool whole = WIFEXITED(status) && WEXITSTATUS(status) == 0 && answer.is_object() && answer.contains("hash") &&
                     answer["hash"].is_string() && answer.contains("title") && answer["title"].is_string() &&
                     answer.contains("memory_bytes") && answer["memory_bytes"].is_number_unsigned();
  if (!whole && WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGXFSZ))
    return failure(ErrorCode::exhausted, "reading the case takes more processor time or disk than allowed");
  if (!whole)
    return failure(ErrorCode::invalid_input, "the case is damaged so that it cannot be read; import it again");
  const Result<Digest> hash = digest_from_hex(answer["hash"].get<std::string>());
  if (!hash) return tl::unexpected(hash.error());
  // A process that the file has taken over may have left anything there.
  if (!has_plain_files(folder / kSoundCase))
    return failure(ErrorCode::invalid_input, "the case is damaged so that it cannot be read; import it again");
  return CheckedCase{*hash, answer["title"].get<std::string>(), answer["memory_bytes"].get<std::uint64_t>()};
}

void run_case_check(const fs::path& archive, const fs::path& folder, const std::string& quota_text) {
  limit_self(RLIMIT_CORE, 0);
  ::prctl(PR_SET_DUMPABLE, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::close_range(3, ~0U, 0);  // closes everything that the server had open
  const Confinement held = confine_to(folder);
  nlohmann::json answer;
  try {
    const Result<SentCase> read = unpack_and_read(archive, folder / "sent", quota_of(quota_text));
    if (const Result<void> kept = read ? write_again(*read, folder / kSoundCase) : tl::unexpected(read.error()); !kept)
      answer = {{"error", kept.error().message}, {"code", word_of(kept.error().code)}};
    else
      answer = {{"hash", to_hex(read->bone.hash())},
                {"title", read->bone.info().title},
                {"memory_bytes", read->bone.memory_bytes()}};
  } catch (const std::bad_alloc&) {
    answer = {{"error", "reading the case takes more memory than allowed"}, {"code", word_of(ErrorCode::exhausted)}};
  } catch (const std::exception& broken) {
    answer = {{"error", std::string("the case is not sound: it cannot be read: ") + broken.what()}};
  }
  if (answer.contains("error")) answer["error"] = bounded_text(answer["error"].get<std::string>());
  answer["files_held"] = held.files;
  answer["calls_held"] = held.calls;
  const std::string line = answer.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace) + "\n";
  std::fputs(line.c_str(), stdout);
  std::fflush(stdout);
  // At once: what an untrusted file may have damaged is not used again. A sanitizer would look for leaks now, which
  // needs rights that this process has given up.
  std::_Exit(answer.contains("error") ? 1 : 0);
}

}  // namespace osteon
