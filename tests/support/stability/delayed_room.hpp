// A room behind a slow network, on virtual time. It commits cuts in the order of their arrival and undoes some of them.
// Every message is delayed both ways.
#pragma once
#include <cstdint>
#include <deque>
#include <variant>
#include <vector>

#include "common/volume/cut_field.hpp"
#include "common/volume/replica.hpp"

namespace osteon::test {

class DelayedRoom {
 public:
  DelayedRoom(const Case& bone, int delay_ticks);

  // Actions in this tick: the client sends its cut; another's cut is committed at once; the last `count` commits are
  // undone.
  void send(const Cut& own);
  void commit_other(Cut cut);
  void undo(int count);
  // Advances one tick. The room decides what has arrived. The client's replica gets what has arrived there.
  void tick(Replica& client);

  [[nodiscard]] std::uint64_t lease_epoch() const { return client_epoch_; }  // as the client knows it
  [[nodiscard]] std::uint64_t undone() const { return undone_; }
  [[nodiscard]] std::uint64_t others() const { return others_; }
  [[nodiscard]] bool quiet() const { return to_room_.empty() && to_client_.empty(); }
  [[nodiscard]] Digest hash() const { return field_.hash(); }

 private:
  struct Committed {
    Cut cut;
    bool own;
  };
  struct Rejected {
    std::uint64_t author_seq;
  };
  struct Changed {
    std::vector<FieldLeaf> leaves;
    std::uint64_t lease_epoch;
  };
  using Word = std::variant<Committed, Rejected, Changed>;
  struct ToClient {
    std::int64_t due;
    RoomSeq place;
    Word word;
  };
  void say(Word word);

  int delay_ticks_;
  std::int64_t now_ = 0;
  CutField field_;
  std::vector<Cut> cuts_;  // not undone
  std::deque<std::pair<std::int64_t, Cut>> to_room_;
  std::deque<ToClient> to_client_;
  std::uint64_t room_seq_ = 0, epoch_ = 0, client_epoch_ = 0, undone_ = 0, others_ = 0;
};

}  // namespace osteon::test
