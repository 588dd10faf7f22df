// Whether what is left of a journal keeps every promise, by what clients were told.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>

#include "tests/integration/breaker_stage.hpp"

namespace osteon::test {

// What a judgement goes by.
struct Trial {
  std::filesystem::path folder;
  const Oracle* oracle;
  std::uint64_t most_entries;  // that there can be
  wire::JoinedRoom member;
  bool loses_nothing = false;  // whatever is said, every acknowledged entry must be there
  bool only_verify = false;    // and export, where that finds nothing
  std::string name = BreakerStage::kRoom;
  [[nodiscard]] std::string file() const { return (folder / (name + ".journal")).string(); }
};

enum class Outcome { whole, named, refused };

struct Verdict {
  Outcome outcome = Outcome::whole;
  bool without_number = false;
  std::string fault;  // empty: every promise was kept
};

class BreakerJudge {
 public:
  // `thorough`: every command in every trial, not some of them.
  BreakerJudge(const BreakerStage& stage, bool thorough) : stage_(&stage), thorough_(thorough) {}

  // Commands that read, recovery, and last a server, to which a client comes back with what it was told.
  [[nodiscard]] Verdict judge(Random& random, const Trial& trial) const;
  // The room has failed: it says so to who is in it and to who comes, with file and remedy. What it does otherwise.
  [[nodiscard]] static std::string unsaid_failure(Server& server, LightHand& hand, const std::string& file);
  // A command that failed must have said why, and about which file. What it does otherwise.
  [[nodiscard]] static std::string refusal(const std::string& what, const RunResult& result, const std::string& file);

 private:
  // What `said` leaves unsaid of what is lost; empty: nothing.
  [[nodiscard]] static std::string unsaid(const std::string& what, const std::string& text, std::uint64_t events,
                                          std::uint64_t lost, const Trial& trial, bool* without_number);
  [[nodiscard]] std::string try_export(const Trial& trial) const;
  [[nodiscard]] std::string try_replay(const Trial& trial) const;
  [[nodiscard]] std::string try_copy(const Trial& trial, const std::string& how) const;  // backup and branch
  // `serve`: what was recovered takes cuts again.
  [[nodiscard]] std::string try_recover(const Trial& trial, const Verified& found, bool serve,
                                        bool* without_number) const;
  // A client comes back with what it was told, cuts, and the server is killed once more.
  [[nodiscard]] std::string try_serve(const Trial& trial, const Verified& found, Outcome* outcome) const;

  const BreakerStage* stage_;
  const bool thorough_;
};

}  // namespace osteon::test
