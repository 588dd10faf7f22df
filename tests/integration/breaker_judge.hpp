// Decides whether the rest of a journal keeps every promise, compared with what clients received.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>

#include "tests/integration/breaker_stage.hpp"

namespace osteon::test {

// Input of a judgement.
struct Trial {
  std::filesystem::path folder;
  const Oracle* oracle;
  std::uint64_t most_entries;  // that are possible
  wire::JoinedRoom member;
  bool loses_nothing = false;  // every acknowledged entry must be there, whatever is reported
  bool only_verify = false;    // and export, if verify finds nothing
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
  // `thorough`: runs every command in every trial, not only some.
  BreakerJudge(const BreakerStage& stage, bool thorough) : stage_(&stage), thorough_(thorough) {}

  // Runs the commands that read, then salvage, and last a server, to which a client comes back with the state it had
  // received.
  [[nodiscard]] Verdict judge(Random& random, const Trial& trial) const;
  // After a failure of the room, it must report file and remedy to its members and to new clients. Returns what it does
  // instead.
  [[nodiscard]] static std::string unsaid_failure(Server& server, LightHand& hand, const std::string& file);
  // A command that failed must have given a reason and the file. Returns what it does instead.
  [[nodiscard]] static std::string refusal(const std::string& what, const RunResult& result, const std::string& file);

 private:
  // The losses that `text` does not report. Empty: it reports all.
  [[nodiscard]] static std::string unsaid(const std::string& what, const std::string& text, std::uint64_t events,
                                          std::uint64_t lost, const Trial& trial, bool* without_number);
  [[nodiscard]] std::string try_export(const Trial& trial) const;
  [[nodiscard]] std::string try_replay(const Trial& trial) const;
  [[nodiscard]] std::string try_copy(const Trial& trial, const std::string& how) const;  // backup and branch
  // `serve`: also checks that the salvaged room takes cuts again.
  [[nodiscard]] std::string try_recover(const Trial& trial, const Verified& found, bool serve,
                                        bool* without_number) const;
  // A client comes back with the state it had received, and cuts. Then the server is killed once more.
  [[nodiscard]] std::string try_serve(const Trial& trial, const Verified& found, Outcome* outcome) const;

  const BreakerStage* stage_;
  const bool thorough_;
};

}  // namespace osteon::test
