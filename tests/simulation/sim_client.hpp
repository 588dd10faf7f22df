// A haptic client on virtual time. It joins, cuts with a seeded hand, keeps a replica, and reconnects when its
// connection breaks. Between SimStream and the replica it uses the same parts as osteon-haptic.
#pragma once
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/link/backoff.hpp"
#include "common/volume/replica.hpp"
#include "haptic_client/net/cuts_underway.hpp"
#include "haptic_client/net/session_reader.hpp"
#include "haptic_client/prediction/confirmation_monitor.hpp"
#include "tests/simulation/ledger.hpp"
#include "tests/simulation/sim_link.hpp"
#include "tests/simulation/sim_server.hpp"
#include "tests/simulation/sim_stream.hpp"

namespace osteon::test {

struct HandPlan {
  std::vector<Tool> tools;
  int level = 0;                                                         // of every cut, at most
  double reach_mm = 3.0;                                                 // from the middle of the block's upper face
  int cuts = 30;                                                         // in total
  int run = 8;                                                           // consecutive cuts, at most
  std::chrono::nanoseconds pause_most = std::chrono::milliseconds(800);  // between two runs
  // Probabilities between two runs:
  double undo = 0.12, redo = 0.10, mark = 0.05, again = 0.15, beyond = 0.08, supervise = 0.35, say = 0.05;
};

// Conditions of a client's datagrams.
struct DatagramPlan {
  bool wanted = false;                            // it uses the fast path if it is offered
  PathQuality quality;                            // both ways
  bool up_blocked = false, down_blocked = false;  // permanently: something on the way blocks all
  wire::LinkOptions link;
  std::chrono::nanoseconds clock_ahead{};
};

class SimClient {
 public:
  using Time = VirtualTime::Time;
  static constexpr std::size_t kMostUnderway = 1024;  // RoomSession::kMaxWaitingCuts

  SimClient(VirtualTime& time, Ledger& ledger, SimServer& server, Datagrams& datagrams, std::uint64_t number,
            std::uint64_t seed, const Case& bone, const HandPlan& hand, const DatagramPlan& plan, Breakage breakage);
  void start();  // starts the program; its hand begins when it has the bone
  void rest() { resting_ = true; }
  void leave();  // permanently
  void break_line(const std::string& why) {
    if (stream_) stream_->break_off(why);
  }
  [[nodiscard]] SimPath& path() { return path_; }
  // Sends datagrams from another address, as after a router has dropped its mapping.
  void move();
  // In this time no datagram gets through, on the way up, down or both.
  void stop_datagrams(bool up, bool down, Time from, Time until);
  // From now on, permanently.
  void block_datagrams(bool up, bool down);
  void heal();  // all ways that are not blocked are good from now on

  [[nodiscard]] bool here() const { return !gone_; }
  [[nodiscard]] bool settled() const;
  // It is connected or gone, and all that the network held back until now has arrived, its requests too.
  [[nodiscard]] bool connected() const;
  [[nodiscard]] std::string standing() const;  // for messages
  [[nodiscard]] AuthorId author() const { return room_ ? room_->author : AuthorId{}; }
  [[nodiscard]] const Restrictions& held() const { return held_; }  // for its hand, as it received them
  [[nodiscard]] Digest hash() const { return replica_->hash(); }
  [[nodiscard]] RoomSeq room_seq() const { return replica_->room_seq(); }
  [[nodiscard]] std::uint64_t cuts() const { return cuts_made_; }
  [[nodiscard]] std::uint64_t denied() const { return denied_; }  // requests that were refused because of restrictions
  [[nodiscard]] std::uint64_t resumed() const { return resumed_; }
  [[nodiscard]] std::uint64_t programs() const { return programs_; }
  // Milliseconds from others' cuts until the replica had them, for each way of delivery.
  [[nodiscard]] const std::vector<float>& felt_by_datagram_ms() const { return felt_by_datagram_ms_; }
  [[nodiscard]] const std::vector<float>& felt_by_stream_ms() const { return felt_by_stream_ms_; }

 private:
  struct Received {
    RoomMessage message;
    bool by_datagram;
  };

  template <class Answer>
  void ask(std::function<void(std::function<void(const Result<Answer>&)>)> request, Time patience,
           std::function<void(const Result<Answer>&)> heard);
  template <class Call>
  void later(Time in, Call call);  // unless the program has ended by then
  void join();
  void joined(const SimServer::Joined& room);
  void open_line();
  void line_ended(const Ending& ending);
  void come_again();
  void lost(const std::string& why);
  void start_anew();
  void send();
  void hear(const std::string& bytes);
  void follow(const v1::SessionResponse& response);
  void open_fast_path(std::uint64_t decided);
  void set_ways();  // of the present address
  void hear_entry(wire::IndexedEntry entry);
  void compare(const v1::SessionResponse& response);  // compares with what a datagram has said of the same entry
  [[nodiscard]] RoomCallbacks callbacks();

  // The ledger compares what was received with what the room has decided.
  void note(const FieldLeaf&) {}
  void note(const RoomAtJoin& room);
  void note(const CutCommitted& committed);
  void note(const CutRejected& rejected);
  void note(const BonePart& part);
  void note(const SceneSet& scene);
  void note(const HandSupervised& decided);
  void note(const ChatReceived& said);
  void note(const EventNoted& noted);
  void note(const Interrupted&) {}
  void pass(RoomMessage&& message);
  void work();  // the replica's thread wakes up
  void take(const FieldLeaf& leaf);
  void take(const RoomAtJoin& room);
  void take(const CutCommitted& committed);
  void take(const CutRejected& rejected);
  void take(const BonePart& part);
  void take(const HandSupervised& decided);
  void take(const SceneSet& scene) { replica_->note(scene.seq); }
  void take(const ChatReceived& said) { replica_->note(said.seq); }
  void take(const EventNoted& noted) { replica_->note(noted.seq); }
  void take(const Interrupted&);
  void measure(const CutCommitted& committed, bool by_datagram);  // how late others' cuts are felt
  void follow_lease(std::uint64_t epoch);
  void watch();

  void move_hand();
  void cut(int left);
  void do_something_else();
  void supervise();
  void change(std::function<Result<RoomEvent>(Room&, AuthorId)> change);

  VirtualTime& time_;
  Ledger& ledger_;
  SimServer& server_;
  Datagrams& datagrams_;
  const std::uint64_t number_;
  Random random_;
  SimPath path_;
  DatagramPlan plan_;
  int up_stopped_ = 0, down_stopped_ = 0;
  std::uint16_t port_ = 0;  // of its address
  std::vector<float> felt_by_datagram_ms_, felt_by_stream_ms_;
  const Case& bone_;
  const HandPlan hand_;
  const Breakage breakage_;
  std::uint64_t life_ = 0, programs_ = 0;
  bool gone_ = false, resting_ = false;
  std::optional<std::string> user_;
  int cuts_left_;
  std::uint64_t cuts_made_ = 0, resumed_ = 0, denied_ = 0;

  // Of the running program.
  std::optional<SimServer::Joined> room_;
  std::shared_ptr<SimStream> stream_;  // shared with actions in progress on it
  std::optional<CutsUnderway> underway_;
  std::optional<SessionReader> reader_;
  std::optional<v1::LinkOffer> offer_;  // of the present stream
  std::vector<std::pair<std::uint32_t, Digest>> numbered_tools_;
  std::unique_ptr<SimFastPath> fast_;
  std::map<std::uint64_t, wire::SessionEntry> said_;  // by datagrams: entries of the present stream by index
  bool by_datagram_ = false;                          // how the present message arrived
  std::uint64_t state_seq_ = 0;
  Time requests_there_{}, held_back_until_{};
  std::optional<Backoff> backoff_;
  std::shared_ptr<ToolBox> tools_;  // shared with the replica's fields
  std::optional<Replica> replica_;
  haptic::ConfirmationMonitor watch_;
  haptic::RoomHealth health_{};
  std::deque<Received> from_room_;
  std::vector<FieldLeaf> renewed_;
  std::vector<Cut> own_;
  bool work_planned_ = false, bone_is_here_ = false, interrupted_ = false, heard_ = false;
  std::uint64_t lease_epoch_ = 0;
  Restrictions held_;
  std::map<std::uint64_t, std::uint64_t> felt_;  // own cuts that must be predicted, with their leases
  QuantisedPose at_;
};

}  // namespace osteon::test
