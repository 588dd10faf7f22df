// What a haptic client has to say to its room: cuts until they are decided, and the newest state. Whatever line carries
// them may break; what was not decided goes again over the next one.
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "common/field/cut.hpp"
#include "common/mechanics/cutting_state.hpp"

namespace osteon {

// Not synchronised.
class CutsUnderway {
 public:
  explicit CutsUnderway(std::size_t most) : most_(most) {}

  // In author_seq order. False, and it is not taken, when `most` are not decided yet.
  bool push(Cut cut);
  void push(CuttingState state) { state_ = std::move(state); }  // newest wins

  // A line is made anew: nothing goes over it before its room has said what it has decided.
  void stop() { may_go_ = false; }
  // The room has decided all cuts up to this one; the others go from the first on.
  void go_on(std::uint64_t decided);
  // The line that had them may not have brought them: all that are undecided go once more.
  void again() { next_ = 0; }
  // Decided: committed or rejected.
  void decided(std::uint64_t author_seq);

  [[nodiscard]] bool something_to_send() const { return may_go_ && (next_ < cuts_.size() || state_); }
  // Cuts before states, so that a state never tells of bone that the server still has.
  [[nodiscard]] std::optional<Cut> take_cut();
  [[nodiscard]] std::optional<CuttingState> take_state();
  [[nodiscard]] std::size_t undecided() const { return cuts_.size(); }
  [[nodiscard]] bool may_go() const { return may_go_; }

 private:
  const std::size_t most_;
  std::deque<Cut> cuts_;  // not known to be decided
  std::size_t next_ = 0;  // of these, the first that did not go over the present line
  std::optional<CuttingState> state_;
  bool may_go_ = false;
};

}  // namespace osteon
