// What the breaker works with: servers on a case, the files that they leave, and commands on these.
#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "tests/integration/oracle.hpp"
#include "tests/support/process.hpp"
#include "tests/support/scenes/random.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon::test {

using Image = std::map<std::string, std::string>;  // bytes of the files of a folder by their names

[[nodiscard]] std::string read_bytes(const std::filesystem::path& file);
[[nodiscard]] Image image_of(const std::filesystem::path& folder);
void put(const Image& image, const std::filesystem::path& folder);
// What differs, as "NAME was changed"; empty: nothing.
[[nodiscard]] std::string difference(const Image& before, const Image& after);
[[nodiscard]] std::string said(const RunResult& result);

// A server on FOLDER/NAME.journal.
struct Server {
  std::unique_ptr<Process> process;
  std::string address;  // empty: it ended before it listened
};

// What a killed server leaves.
struct Life {
  Image image;
  std::vector<Image> earlier;  // of moments before
  Oracle oracle;
  wire::JoinedRoom member;    // of a client that may come back
  std::uint64_t entries = 0;  // that the journal has, as the killed server left it
  std::string fault;          // in what needed no damage
};

// What `verify` says.
struct Verified {
  bool sound = false;
  bool read = false;  // it says how far the events go
  std::uint64_t events = 0, witnessed = 0;
  std::string text;
  // A checkpoint may be lost: the one before it, or the entries, then serve instead.
  [[nodiscard]] bool only_checkpoint() const;
};

// A shell in a mount namespace of its own, and programs beside it.
class Mounter {
 public:
  explicit Mounter(std::filesystem::path place);
  // A disk in memory. False: this machine lets nobody mount one.
  [[nodiscard]] bool mount(const std::string& size);
  [[nodiscard]] bool make_read_only();
  [[nodiscard]] const std::filesystem::path& place() const { return place_; }
  // What a program begins with to see the mounts.
  [[nodiscard]] std::vector<std::string> prefix() const;
  // By which those outside see them.
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

  // Of all servers here; not among the files that are damaged.
  [[nodiscard]] std::string key() const { return (temp_ / "signing.key").string(); }
  [[nodiscard]] std::string audit() const { return (temp_ / "audit.log").string(); }  // not among what is damaged
  [[nodiscard]] const std::string& bone() const { return bone_; }
  [[nodiscard]] std::filesystem::path new_folder() const;
  [[nodiscard]] std::filesystem::path new_name() const;  // of a file that is not there
  // As seen from here, of a folder as servers and commands see it.
  [[nodiscard]] std::filesystem::path seen(const std::filesystem::path& folder) const {
    return root_ / folder.relative_path();
  }
  [[nodiscard]] RunResult command(const std::vector<std::string>& arguments,
                                  std::chrono::milliseconds patience = kPatience) const;
  // On FOLDER/NAME.journal.
  [[nodiscard]] Server start(const std::filesystem::path& folder, const std::string& name = kRoom,
                             ProcessOptions options = {}) const;
  static void kill(Server& server);
  // Stops a server in the middle of whatever it does. What it has asked of the disk is over when this returns.
  static void freeze(Server& server);
  // At most so long, with moments that are marked and people who come, for whom the log begins anew.
  void load(std::uint64_t seed, const Server& server, LightHand& hand, Oracle& oracle, std::size_t most_ms) const;
  // A server that works for a while, in one to three lives, and is killed at a random moment.
  void live(std::uint64_t seed, const std::string& name, Life& life) const;
  [[nodiscard]] Verified verify(const std::string& file) const;
  // What an export of the journal lacks up to a place; empty: nothing. `all`: nobody says how far it is to go.
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

// For as long as it lives, servers and commands of a stage run behind a prefix, and see under / what is under `root`
// here.
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
