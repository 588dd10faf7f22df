// The cutting states of a recorded session, one after another.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "common/core/result.hpp"
#include "common/mechanics/cutting_state.hpp"

namespace osteon::audio {

// Memory does not grow with the length of the session.
class StateRecord {
 public:
  virtual ~StateRecord() = default;

  // The next state, with its time_ns, in the order of time. Nothing at the end. Error invalid_input: names file, row,
  // field and remedy.
  [[nodiscard]] Result<std::optional<CuttingState>> next();
  // One sentence on the first state whose tool this build does not know: it names file, row, field and the known names.
  // Such a tool sounds like a drill. Empty if there is none so far.
  [[nodiscard]] const std::string& unknown_tool() const { return unknown_tool_; }
  [[nodiscard]] virtual double done() const = 0;  // share that was read, 0 to 1
  [[nodiscard]] virtual std::string name() const = 0;

 protected:
  // As next(), without the checks that all records share.
  [[nodiscard]] virtual Result<std::optional<CuttingState>> read() = 0;
  // Where the last state stands: "FILE: line 7: mono_ns " for a field.
  [[nodiscard]] virtual std::string place(const char* field) const = 0;

 private:
  void note_tool(const std::string& name);

  std::optional<std::int64_t> first_ns_, last_ns_;
  std::string last_tool_, unknown_tool_;
};

inline constexpr double kLongestSession_s = 4 * 3600.0;

// Opens what osteon-haptic wrote: a recording (--record), or a session log (--session-log). A session that is still
// under way, or whose program was killed, is read as far as it goes. Errors: not_found, invalid_input, unsupported; one
// sentence with file, field and remedy.
[[nodiscard]] Result<std::unique_ptr<StateRecord>> open_states(const std::filesystem::path& file);

}  // namespace osteon::audio
