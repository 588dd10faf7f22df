// Turns what comes from a room, over its stream and over the fast path, into one order of events.
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
#include "haptic_client/net/room_callbacks.hpp"
#include "osteon/v1/cutting.pb.h"

namespace osteon {

// Every entry after the leaves comes over the stream; rejections, supervision and cuts of anyone may come sooner over the
// fast path. Whichever is first counts. Not synchronised.
class SessionReader {
 public:
  // `decided`: own cuts up to a number are decided; `complete`: the same, and from here on cuts may be sent. Both are
  // called before the event itself.
  SessionReader(AuthorId own, std::shared_ptr<ToolBox> tools, RoomCallbacks events,
                std::function<void(std::uint64_t)> decided, std::function<void(std::uint64_t)> complete);

  // A stream begins: its leaves and entries count anew, and so does place(), as the server may have lost the end of what
  // an earlier one told. What was said to be kept stays: it is what shows such a loss.
  void begin();
  // Error: the server sent what no correct server sends; nothing more of the stream is to be taken.
  [[nodiscard]] Result<void> take(v1::SessionResponse response);
  // An entry of the fast path that belongs to the present stream.
  [[nodiscard]] Result<void> take(wire::IndexedEntry entry);
  // Every entry up to this one was passed on.
  [[nodiscard]] std::uint64_t taken() const { return entries_.acknowledged(); }
  // Another's tool, heard of over the fast path.
  void take(const CuttingState& partner);
  // The newest event of the present stream that was passed on, or that its leaves contain once all of them have come.
  [[nodiscard]] RoomSeq place() const { return place_; }
  // The newest that the room has said is kept.
  [[nodiscard]] const std::optional<wire::DurableSeq>& kept() const { return kept_; }

 private:
  using Entry = std::variant<v1::SessionResponse, wire::SessionEntry>;
  [[nodiscard]] Result<void> pass_on();
  [[nodiscard]] Result<void> deliver(const v1::SessionResponse& response);
  [[nodiscard]] Result<void> deliver(const wire::SessionEntry& entry);
  [[nodiscard]] bool cuts(const Cut& cut) const;  // with a tool that was sent
  void committed(RoomSeq place, const Cut& cut);
  void supervised(const HandSupervised& decided);
  void rejected(RoomSeq place, std::uint64_t author_seq, std::uint64_t lease_epoch, const std::string& reason);

  const AuthorId own_;
  const std::shared_ptr<ToolBox> tools_;  // shared with the replica's fields
  const RoomCallbacks events_;
  const std::function<void(std::uint64_t)> decided_, complete_;
  ReceiveWindow<Entry> entries_;
  std::optional<wire::DurableSeq> kept_;
  RoomSeq place_;
  bool supervised_ = false;                     // of the present stream, before its leaves are complete
  std::map<AuthorId, std::uint64_t> partners_;  // newest state_seq of each
};

}  // namespace osteon
