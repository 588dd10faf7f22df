// Merges what a room sends over its stream and over the fast path into one order of events.
#pragma once
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <variant>

#include "common/core/result.hpp"
#include "common/link/receive_window.hpp"
#include "common/tools/tool_box.hpp"
#include "common/wire/cut_run.hpp"
#include "common/wire/room_client.hpp"
#include "haptic_client/net/room_messages.hpp"
#include "osteon/v1/cutting.pb.h"

namespace osteon {

// Every log entry after the leaves is sent over the stream. Rejections, restrictions and anyone's cuts may arrive
// earlier over the fast path. The first to arrive counts. Not synchronised.
class SessionReader {
 public:
  // `decided`: own cuts up to a number are decided. `complete`: the same, and cuts may be sent from here on. Both are
  // called before the message itself.
  SessionReader(AuthorId own, std::shared_ptr<ToolBox> tools, RoomCallbacks callbacks,
                std::function<void(std::uint64_t)> decided, std::function<void(std::uint64_t)> complete);

  // A stream begins. Its leaves and log entries are counted anew. place() restarts too, because the server may have
  // lost the newest events of an earlier stream. What was acknowledged as durable stays: it reveals such a loss.
  void begin();
  // Error: the server sent what no correct server sends. It stays, and nothing more of this stream is passed on.
  [[nodiscard]] Result<void> take(v1::SessionResponse response);
  // A log entry of the fast path that belongs to the present stream, in any order. Error: as above.
  [[nodiscard]] Result<void> take(wire::IndexedEntry entry);
  // That error, if there is one.
  [[nodiscard]] const std::optional<Error>& fault() const { return fault_; }
  // Every log entry up to this one was passed on.
  [[nodiscard]] std::uint64_t taken() const { return entries_.acknowledged(); }
  // A partner's tool state that was received over the fast path.
  void take(const CuttingState& partner);
  // Sequence number of the newest event of the present stream that was passed on. Once all leaves have arrived, the
  // newest that they contain.
  [[nodiscard]] RoomSeq seq() const { return seq_; }
  // The newest event that the room has acknowledged as durable.
  [[nodiscard]] const std::optional<wire::DurableSeq>& kept() const { return kept_; }

 private:
  using Entry = std::variant<v1::SessionResponse, wire::SessionEntry>;
  [[nodiscard]] Result<void> pass_on();
  [[nodiscard]] Result<void> remember(Result<void> delivered);
  [[nodiscard]] Result<void> deliver(const v1::SessionResponse& response);
  [[nodiscard]] Result<void> deliver(const wire::SessionEntry& entry);
  [[nodiscard]] bool cuts(const Cut& cut) const;  // with a tool that was sent
  void pass(RoomMessage&& message);
  [[nodiscard]] Result<void> committed(RoomSeq seq, const Cut& cut);
  void supervised(const HandSupervised& decided);
  void rejected(const CutRejected& rejected);

  const AuthorId own_;
  const std::shared_ptr<ToolBox> tools_;  // shared with the replica's fields
  const RoomCallbacks callbacks_;
  const std::function<void(std::uint64_t)> decided_, complete_;
  // The fast path acknowledges entries as they arrive, and hands them over later: those of 64 datagrams, some hundreds
  // in each. Meanwhile the stream skips them and may be as far ahead. What it then delivers comes only once, so it must
  // fit.
  static constexpr std::uint64_t kMostAhead = 1 << 16;
  ReceiveWindow<Entry> entries_{1, kMostAhead};
  std::optional<Error> fault_;
  std::optional<wire::DurableSeq> kept_;
  RoomSeq seq_;
  bool supervised_ = false;  // restrictions of the present stream were passed on, before its leaves are complete
  std::map<AuthorId, std::uint64_t> partners_;  // newest state_seq of each partner
};

}  // namespace osteon
