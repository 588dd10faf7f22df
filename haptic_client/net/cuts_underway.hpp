// What a haptic client has to send to its room: its undecided cuts, and the newest state. Any connection that carries
// them may break. Undecided cuts are sent again over the next one.
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

  // Call in author_seq order. Returns false and does not take the cut when `most` cuts are undecided.
  bool push(Cut cut);
  void push(CuttingState state) { state_ = std::move(state); }  // newest wins

  // A new connection is being made. Nothing is sent over it before the room has said which cuts it has decided.
  void stop() { may_go_ = false; }
  // The room has decided all cuts up to this one. Sending continues with the first undecided cut.
  void go_on(std::uint64_t decided);
  // The connection that carried the cuts may have lost them: all undecided cuts are sent again.
  void again() { next_ = 0; }
  // Decided: committed or rejected.
  void decided(std::uint64_t author_seq);

  [[nodiscard]] bool something_to_send() const { return may_go_ && (next_ < cuts_.size() || state_); }
  // Take cuts before states. Otherwise a state could describe bone as removed that the server still has.
  [[nodiscard]] std::optional<Cut> take_cut();
  [[nodiscard]] std::optional<CuttingState> take_state();
  [[nodiscard]] std::size_t undecided() const { return cuts_.size(); }
  [[nodiscard]] bool may_go() const { return may_go_; }

 private:
  const std::size_t most_;
  std::deque<Cut> cuts_;  // not known to be decided
  std::size_t next_ = 0;  // index of the first cut not yet sent over the present connection
  std::optional<CuttingState> state_;
  bool may_go_ = false;
};

}  // namespace osteon
