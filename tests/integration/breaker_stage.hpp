// Tools for the breaker: servers on a case, the files that they leave, and commands on these files.
#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tests/integration/oracle.hpp"
#include "tests/support/process.hpp"
#include "tests/support/scenes/random.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon::test {

using Image = std::map<std::string, std::string>;  // bytes of the files of a folder, by name

[[nodiscard]] std::string read_bytes(const std::filesystem::path& file);
[[nodiscard]] Image image_of(const std::filesystem::path& folder);
void put(const Image& image, const std::filesystem::path& folder);
// What differs, as "NAME was changed". Empty: nothing.
[[nodiscard]] std::string difference(const Image& before, const Image& after);
[[nodiscard]] bool has(const std::string& text, std::string_view part);
// The number in the line "LABEL: NUMBER" of a command's output. LABEL is a regular expression.
[[nodiscard]] std::optional<std::uint64_t> number_after(const std::string& text, const std::string& label);
[[nodiscard]] std::string said(const RunResult& result);

// A server on FOLDER/NAME.journal.
struct Server {
  std::unique_ptr<Process> process;
  std::string address;  // empty: the server ended before it listened
};

// What a killed server leaves.
struct Life {
  Image image;
  std::vector<Image> earlier;  // of earlier moments
  Oracle oracle;
  wire::JoinedRoom member;    // of a client that may come back
  std::uint64_t entries = 0;  // that the journal has after the kill
  std::string fault;          // a fault that appeared without any damage
};

// Result of `verify`.
struct Verified {
  bool sound = false;
  bool read = false;  // verify reports how far the events go
  std::uint64_t events = 0, witnessed = 0;
  std::string text;
  // True if at most a checkpoint is lost. The checkpoint before it, or the entries, then serve instead.
  [[nodiscard]] bool only_checkpoint() const;
};

// A shell in a mount namespace of its own. Programs can run in the same namespace.
class Mounter {
 public:
  explicit Mounter(std::filesystem::path place);
  // Mounts a disk in memory. False: this machine does not allow mounts.
  [[nodiscard]] bool mount(const std::string& size);
  [[nodiscard]] bool make_read_only();
  [[nodiscard]] const std::filesystem::path& place() const { return place_; }
  // Command prefix with which a program sees the mounts.
  [[nodiscard]] std::vector<std::string> prefix() const;
  // Path by which programs outside see the mounts.
  [[nodiscard]] std::filesystem::path root() const;

 private:
  [[nodiscard]] bool run(const std::string& line);
  const std::filesystem::path place_;
  Process shell_;
};

class BreakerStage {
 public:
  static constexpr std::chrono::seconds kPatience{30};
  static constexpr const char* kRoom = "room";

  // `longer`: servers work longer before they are killed.
  explicit BreakerStage(bool longer);

  // Signing key of all servers here. It is not among the files that are damaged.
  [[nodiscard]] std::string key() const { return (temp_ / "signing.key").string(); }
  // not among the files that are damaged
  [[nodiscard]] std::string audit() const { return (temp_ / "audit.log").string(); }
  [[nodiscard]] const std::string& bone() const { return bone_; }
  [[nodiscard]] std::filesystem::path new_folder() const;
  [[nodiscard]] std::filesystem::path new_name() const;  // of a file that does not exist
  // Path in this process for a folder that servers and commands see.
  [[nodiscard]] std::filesystem::path seen(const std::filesystem::path& folder) const {
    return root_ / folder.relative_path();
  }
  [[nodiscard]] RunResult command(const std::vector<std::string>& arguments,
                                  std::chrono::milliseconds patience = kPatience) const;
  // On FOLDER/NAME.journal.
  [[nodiscard]] Server start(const std::filesystem::path& folder, const std::string& name = kRoom,
                             ProcessOptions options = {}) const;
  static void kill(Server& server);
  // Stops a server at any point of its work. Its disk requests are finished when this returns.
  static void freeze(Server& server);
  // Works for a limited time, with marked moments and people who join. The log begins anew for people who join.
  void load(std::uint64_t seed, const Server& server, LightHand& hand, Oracle& oracle, std::size_t most_ms) const;
  // Runs a server for a while, in one to three lives, and kills it at a random moment.
  void live(std::uint64_t seed, const std::string& name, Life& life) const;
  [[nodiscard]] Verified verify(const std::string& file) const;
  // What an export of the journal lacks up to a sequence number. Empty: nothing. `all`: nothing reports how far the
  // export must go.
  [[nodiscard]] std::string check_export(const std::string& file, const Oracle& oracle, std::uint64_t up_to,
                                         bool all = true) const;

 private:
  friend class Behind;
  [[nodiscard]] std::vector<std::string> with_prefix(std::vector<std::string> arguments) const;
  [[nodiscard]] std::filesystem::path first() const;

  const bool longer_;
  TempDir temp_;
  const std::string bone_;
  mutable std::uint64_t names_ = 0;
  std::vector<std::string> prefix_;
  std::filesystem::path root_ = "/";
};

// While an object lives, servers and commands of a stage run behind a command prefix. Their `/` is `root` here.
class Behind {
 public:
  Behind(BreakerStage& stage, std::vector<std::string> prefix, std::filesystem::path root);
  ~Behind();
  Behind(const Behind&) = delete;
  Behind& operator=(const Behind&) = delete;

 private:
  BreakerStage* stage_;
};

}  // namespace osteon::test
