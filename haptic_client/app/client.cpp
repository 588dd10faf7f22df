#include "haptic_client/app/client.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdio>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <thread>
#include <variant>

#include "common/field/rejection.hpp"
#include "common/runtime/log.hpp"
#include "common/runtime/memory_reserve.hpp"
#include "common/runtime/periodic.hpp"
#include "common/runtime/spsc_queue.hpp"
#include "common/runtime/triple_buffer.hpp"
#include "common/runtime/watchdog.hpp"
#include "common/volume/replica.hpp"
#include "haptic_client/app/client_messages.hpp"
#include "haptic_client/app/cut_log.hpp"
#include "haptic_client/contact/guiding.hpp"
#include "haptic_client/contact/patch_builder.hpp"
#include "haptic_client/prediction/confirmation_monitor.hpp"
#include "haptic_client/rendering/felt_mount.hpp"

namespace osteon::haptic {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kTick = 1ms;
constexpr auto kSpin = 150us;
constexpr int kPriority = 80;
constexpr auto kStall = 4ms;                // more than three periods: the force is zero by then
constexpr std::uint64_t kLiveTicks = 1000;  // between two statistics of the haptic loop
constexpr auto kConfirmPatience = 20s;
constexpr auto kStopPatience = 2s;           // after a stop was requested
constexpr auto kJoinPatience = 30s;          // without a message from the room
constexpr std::size_t kMostFromRoom = 4096;  // events that may wait for the replica; beyond that the network waits
constexpr std::size_t kTickTimes = 8192;     // ticks whose wake-up time is stored

std::int64_t ns(Clock::time_point t) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(t.time_since_epoch()).count();
}

class Client {
 public:
  Client(RoomSession& room, Session& session, const ClientOptions& options, const StopSignal& stop)
      : room_(room),
        options_(options),
        stop_(stop),
        session_(session),
        mounted_(mount_about(room.bone().bounds().centre_mm())),
        replica_(room.bone(), BodyId{}, room.tools()),
        lease_epoch_(room.room().lease_epoch) {
    for (auto& time : tick_times_) time.store(0, std::memory_order_relaxed);
    for (const ToolModel& model : session_.plan().tools) tool_names_.push_back(model.tool.name);
    if (tool_names_.empty()) tool_names_.emplace_back("none");
    session_.loop().feel_partners();
    outcome_.limits = session_.device().limits();
    outcome_.loop = session_.loop().params();
    outcome_.removed_mm3.resize(session_.plan().steps.size());
  }

  Result<ClientOutcome> run() {
    if (Result<void> opened = log_.open(options_.session_log, session_.device().info()); !opened)
      return tl::unexpected(opened.error());
    if (Result<void> opened = recorder_.open(options_.record, recording_info()); !opened)
      return tl::unexpected(opened.error());
    open_room();
    std::thread replica([this] { replica_thread(); });
    std::thread reporter([this] { reporter_thread(); });
    if (wait_joined()) {
      std::thread haptic([this] { haptic_thread(); });
      haptic.join();
    }
    touching_over_ = true;
    replica.join();
    all_over_ = true;
    reporter.join();
    outcome_.fast_path = room_.fast_path();
    const MountFollower& shown = mounted_.shown();
    outcome_.mount = {mounted_.there(),    mounted_.most_mm(), mounted_.most_rad(), shown.put_in_mj(),
                      shown.released_mj(), shown.given_mj(),   shown.granted_mj(),  shown.low_pass_s()};
    room_.close();
    {
      const std::lock_guard lock(mutex_);
      outcome_.lost = lost_why_;
    }
    outcome_.stopped = stop_.requested() && !session_.done() && !session_.endless();
    if (!outcome_.lost && !outcome_.stopped && outcome_.unconfirmed > 0)
      outcome_.lost =
          Error{ErrorCode::unavailable, "the server has not confirmed the last " +
                                            std::to_string(outcome_.unconfirmed) + " cuts within " +
                                            std::to_string(kConfirmPatience.count()) + " s; look at the server's log"};
    // Some of the leaves do not belong to any bone that the room ever had.
    if (joined_ && !changing_) outcome_.field_hash = replica_.hash();
    const std::string hash = outcome_.field_hash ? to_hex(*outcome_.field_hash) : "";
    outcome_.recording =
        recorder_.finish({hash, replica_.room_seq().value, outcome_.rows_dropped, outcome_.lost.has_value()});
    if (const Result<void> written = log_.finish(); !written && !outcome_.lost) outcome_.lost = written.error();
    outcome_.restrictions.insert(outcome_.restrictions.end(), loop_notes_.begin(), loop_notes_.end());
    std::ranges::stable_sort(outcome_.restrictions, {}, &RestrictionNote::mono_ns);
    outcome_.coupling_n_per_mm = session_.loop().coupling_n_per_mm();
    outcome_.workspace_scale = session_.loop().mapping().scale();
    outcome_.steps = session_.results();
    outcome_.outside_range = ranges_.uses();
    outcome_.cuts = cut_log_.rows();
    outcome_.removed_total_mm3 = replica_.removed_mm3();
    outcome_.room_seq = replica_.room_seq();
    outcome_.rejected += replica_.rejected();
    outcome_.stalls = watchdog_.stalls();
    outcome_.longest_stall_ms = 1e-6 * static_cast<double>(watchdog_.longest().count());
    outcome_.patch_p50_us = patch_times_.percentile_us(50);
    outcome_.patch_p99_us = patch_times_.percentile_us(99);
    return std::move(outcome_);
  }

 private:
  [[nodiscard]] RecordingInfo recording_info() {
    RecordingInfo info;
    info.device = session_.device().name();
    info.device_info = session_.device().info();
    info.limits = session_.device().limits();
    info.loop = session_.loop().params();
    info.case_hash = to_hex(room_.bone().hash());
    info.case_title = room_.bone().info().title;
    info.pitch_mm = room_.bone().pitch_mm();
    info.author = room_.room().author.value;
    info.plan_digest = to_hex(plan_digest(session_.plan()));
    for (const ToolModel& model : session_.plan().tools)
      info.tools.push_back({model.tool.name, law_name(model), model.tool.diameter_mm});
    return info;
  }

  void open_room() {
    room_.open({
        .message = [this](RoomMessage&& message) { receive(std::move(message)); },
        .partner = [this](const CuttingState& state) { receive_partner(state); },
        .stop_flag =
            [this](std::uint64_t lease_epoch, bool frozen) {
              stop_flag_ = packed(StopFlag{lease_epoch, frozen});
            },
        .bone =
            [this](const MountPose& seen) {
              places_of_bone_.store(MountUpdate{line_, seen});
            },
        .lost = [this](const Error& why) { give_up(why); },
    });
  }

  // [session] Hands a message to the replica's thread. Waits while too many are there.
  void receive(RoomMessage&& message) {
    // Passed to the loop at once: it must not wait for earlier work of the replica.
    if (const auto* decided = std::get_if<HandSupervised>(&message))
      restrictions_.store(
          haptic_restrictions(decided->supervision, decided->seq, decided->lease_epoch, session_.plan().tools));
    if (std::holds_alternative<Interrupted>(message)) ++line_;
    std::unique_lock lock(mutex_);
    // Nothing is taken any more once the replica's thread has ended.
    taken_.wait(lock, [this] { return from_room_.size() < kMostFromRoom || replica_over_; });
    if (replica_over_) return;
    from_room_.push_back(std::move(message));
    received_ns_ = ns(Clock::now());
    wake_.notify_one();
  }

  // Called on whichever thread the session uses for it; one at a time.
  void receive_partner(const CuttingState& state) {
    // The replica's thread makes the solid of a tool that is new here.
    if (!state.tool_name.empty() && named_tools_.size() < PartnerSolids::kMost &&
        named_tools_.insert(state.tool_name).second) {
      const std::lock_guard lock(mutex_);
      tools_to_make_.push_back(state.tool_name);
      wake_.notify_one();
    }
    // The entry with the oldest state is replaced.
    Partners::Partner* place = &received_partners_.of[0];
    for (Partners::Partner& partner : received_partners_.of) {
      if (partner.author == state.author) {
        place = &partner;
        break;
      }
      if (partner.received_ns < place->received_ns) place = &partner;
    }
    *place = {state.author,           state.state_seq,  state.pose_bone_tool,
              state.pose_bone_device, ns(Clock::now()), std::hash<std::string>{}(state.tool_name)};
    partners_.store(received_partners_);
  }

  // [haptic] Applies an instructor's restrictions and guidance.
  void supervise() {
    HapticLoop& loop = session_.loop();
    if (restrictions_.refresh()) loop.supervise(restrictions_.value());
    loop.supervise(unpacked(stop_flag_.load(std::memory_order_relaxed)));
    partners_.refresh();
    loop.see_guide(guide_among(partners_.value(), loop.guard().now().guide));
    partner_solids_.refresh();
    const std::int64_t now_ns = ns(Clock::now());
    const double line_s = line_lag_s_.load(std::memory_order_relaxed);
    std::size_t count = 0;
    for (const Partners::Partner& partner : partners_.value().of)
      if (partner.author)
        felt_partners_[count++] = {partner.author.value, partner.pose_bone_tool,
                                   line_s + 1e-9 * static_cast<double>(now_ns - partner.received_ns),
                                   partner_solids_.value().find(partner.tool)};
    loop.see_partners(std::span(felt_partners_).first(count));
  }

  // [haptic] Moves the bone on its mount under the load of the last tick.
  void move_bone() {
    if (places_of_bone_.refresh()) mounted_.see(places_of_bone_.value().line, places_of_bone_.value().seen);
    mounted_.step(session_.loop(), last_);
    if (const std::optional<MountLoad> push = mounted_.push()) pushes_.store(*push);
  }

  // Spindle and force run down, and the client ends with this reason.
  void give_up(const Error& why) {
    const std::lock_guard lock(mutex_);
    if (!lost_why_) lost_why_ = why;
    link_ok_ = false;
    wake_.notify_one();
  }

  bool wait_joined() {
    received_ns_ = ns(Clock::now());
    while (!joined_ && link_ok_ && !stop_.wait_for(2ms))
      if (Clock::now().time_since_epoch() - std::chrono::nanoseconds(received_ns_) > kJoinPatience)
        give_up({ErrorCode::unavailable, "the server has sent nothing for " + std::to_string(kJoinPatience.count()) +
                                             " s while the bone was fetched; look at the server's log"});
    return joined_ && link_ok_;
  }

  // [haptic] Nothing here allocates, locks, logs or waits, except its own sleep.
  void haptic_thread() {
    outcome_.began_ns = ns(Clock::now());
    outcome_.realtime = try_realtime(kPriority);
    realtime_refused_ = !outcome_.realtime;
    PeriodicTimer timer(kTick, kSpin);
    constexpr int kRunDownTicks = 500;  // after the link is lost or a stop was requested
    int down = 0;
    while (!session_.done() && down < kRunDownTicks) {
      const int periods = timer.wait(outcome_.ticks);
      const bool over = !link_ok_.load(std::memory_order_relaxed) || stop_.requested();
      if (over) ++down;
      patches_.refresh();
      const bool follows = room_health_.load(std::memory_order_relaxed) == RoomHealth::follows;
      if (!follows) ++outcome_.held_for_room_ticks;
      guides_.refresh();
      supervise();
      const RoomLink room = over ? RoomLink::over : follows ? RoomLink::follows : RoomLink::held;
      move_bone();
      const SessionTick now = session_.tick(patches_.value(), room, periods, &guides_.value());
      last_ = now.report;
      items_left_.store(session_.left().size(), std::memory_order_release);

      const std::int64_t woke_ns = ns(timer.woke());
      tick_times_[now.report.state_seq % kTickTimes].store(woke_ns, std::memory_order_relaxed);
      const bool idle = now.order.phase == SurgeonPhase::wait || now.order.phase == SurgeonPhase::done;
      ToolPlace& place = places_.writable();
      place = {now.report.pose_bone_proxy, now.report.tool, static_cast<std::uint32_t>(now.order.step),
               taken_up_ |= !idle};
      places_.publish();
      if (now.report.events & kUncovered && !idle && now.order.phase != SurgeonPhase::take_up)
        ++outcome_.uncovered_ticks;
      if (now.report.events & kCutsWaiting) ++outcome_.cuts_waiting_ticks;

      row_.mono_ns = woke_ns;
      row_.phase = now.order.phase;
      row_.step = static_cast<std::uint32_t>(now.order.step);
      row_.idle = idle;
      row_.report = now.report;
      if (!idle) site_ = &session_.plan().steps[now.order.step].site;
      if (site_) {
        row_.depth_mm = (now.report.pose_bone_proxy.position_mm - site_->entry_mm).dot(site_->axis);
        row_.device_depth_mm = (now.report.pose_bone_device.position_mm - site_->entry_mm).dot(site_->axis);
      }
      row_.force_rendered_n = now.report.force_device_n.norm();
      row_.reading = now.reading;
      row_.commanded_rpm = now.commanded_rpm;
      row_.rendered = {now.report.force_device_n, now.report.torque_device_nmm};
      row_.take_up = now.order.take_up;
      if (row_.take_up) {
        row_.taken_up_at = {now.order.hand.target_mm, now.order.rotation};
        row_.mapping = session_.loop().mapping();
      }
      if (!rows_.try_push(row_)) ++outcome_.rows_dropped;
      timer.done(outcome_.ticks);
      watchdog_.beat();
      if (outcome_.ticks.work.count() % kLiveTicks == 0) live_.store(outcome_.ticks);
    }
    watchdog_.rest();
  }

  // [watchdog] Reports at most every five seconds.
  void stalled() {
    const auto now = Clock::now();
    if (stall_reported_at_ && now - *stall_reported_at_ < 5s) return;
    stall_reported_at_ = now;
    log::warn("the haptic loop has stalled",
              {{"longer_than_ms", kStall.count()}, {"remedy", "see osteon-haptic check"}});
  }

  void replica_thread() {
    std::deque<RoomMessage> messages;
    std::vector<std::string> tools_to_make;
    MemoryReserve reserve(kCutReserve);
    std::optional<Clock::time_point> waiting_since;
    while (true) {
      {
        std::unique_lock lock(mutex_);
        wake_.wait_for(lock, 2ms, [&] { return !from_room_.empty() || !tools_to_make_.empty(); });
        messages.swap(from_room_);
        tools_to_make.swap(tools_to_make_);
        taken_.notify_all();
      }
      const bool any_received = !messages.empty();
      // Read before the queues: what was closed up to here must still be taken.
      const bool over = touching_over_;
      take_own_cuts();
      for (const RoomMessage& message : messages) std::visit([this](const auto& one) { take(one); }, message);
      messages.clear();
      for (const std::string& name : tools_to_make) make_partner_solid(name);
      tools_to_make.clear();
      replica_.settle();
      watch_room(any_received);
      build_patch();
      if (any_received || replica_.unconfirmed() > 0) reserve.refill();
      if (!over) continue;
      if (!waiting_since) waiting_since = Clock::now();
      const bool settled = replica_.unconfirmed() == 0 && unsent_.empty();
      const auto patience = stop_.requested() ? kStopPatience : kConfirmPatience;
      if (settled || !link_ok_ || Clock::now() - *waiting_since >= patience) break;
    }
    outcome_.unconfirmed = replica_.drop_unconfirmed();
    note_removed(outcome_.removed_mm3.size());
    const std::lock_guard lock(mutex_);
    replica_over_ = true;
    taken_.notify_all();
  }

  void take_own_cuts() {
    CutPiece piece;
    while (session_.loop().take_piece(piece)) {
      const Cut cut = cut_of(piece, session_.loop().tool(piece.tool), room_.room().author, lease_epoch_);
      unsent_.push_back(cut);
      const std::int64_t closed_ns =
          tick_times_[static_cast<std::size_t>(piece.closed_tick) % kTickTimes].load(std::memory_order_relaxed);
      cut_log_.closed(piece.author_seq, closed_ns);
      // Sent before it is felt, because the room's answer takes longest.
      send_waiting();
      replica_.add_own(cut);
    }
    send_waiting();
  }

  void send_waiting() {
    while (!unsent_.empty() && room_.send(unsent_.front())) unsent_.pop_front();
  }

  void take(const FieldLeaf& leaf) {
    if (interrupted_)
      renewed_.push_back(leaf);
    else
      replica_.restore(leaf);
  }
  void take(const Interrupted& interrupted) {
    // Contact continues with the present bone. The received leaves replace it all at once, so that no bone is missing
    // in between.
    if (joined_ && !interrupted_)
      log::warn("the connection to the server is interrupted", {{"reason", interrupted.why.message}});
    interrupted_ = joined_;
    renewed_.clear();
    // Before joining, the received bone may have been restored since: begin anew.
    if (!joined_) replica_ = Replica(room_.bone(), BodyId{}, room_.tools());
  }
  void renew(const RoomAtJoin& room) {
    replica_.renew(room.contained, room.bodies, renewed_, room.decided_author_seq);
    outcome_.rejected += cut_log_.confirm(room, ns(Clock::now()));
    follow_lease(room.lease_epoch);
    changing_ = interrupted_ = false;
    renewed_ = {};
    ++outcome_.interruptions;
    log::info("the connection to the server is restored",
              {{"room_seq", room.contained.value}, {"unconfirmed_cuts", replica_.unconfirmed()}});
  }
  void take(const RoomAtJoin& room) {
    if (interrupted_) return renew(room);
    replica_.change(room.contained, room.bodies, {});
    replica_.joined(room.contained);
    lease_epoch_ = room.lease_epoch;
    noted_mm3_ = replica_.removed_mm3();  // by others, before the first step
    if (recorder_.recording() || options_.played) {
      const std::string found = to_hex(replica_.hash());
      recorder_.begin_on(found);
      if (options_.played)
        if (const Result<void> fits = check_played_on(*options_.played, found); !fits) return give_up(fits.error());
    }
    joined_ = true;
  }
  void take(const BonePart& part) {
    replica_.change(part.seq, part.bodies, part.leaves);
    changing_ = !part.last;
    follow_lease(part.lease_epoch);
  }
  // Cuts on their way were based on other bone: the room will reject them.
  void follow_lease(std::uint64_t epoch) {
    if (epoch <= lease_epoch_) return;
    lease_epoch_ = epoch;
    replica_.lease(epoch);
  }
  void take(const HandSupervised& decided) {
    replica_.note(decided.seq);
    follow_lease(decided.lease_epoch);
    const std::string words = in_words(decided.supervision);
    // At the beginning of a connection without restrictions nothing is reported.
    if (words.empty() && !supervised_) return;
    supervised_ = !words.empty();
    const std::string what = words.empty() ? "free" : words, by = called(decided.by);
    log::info("an instructor changed the restrictions",
              {{"room_seq", decided.seq.value}, {"what", what}, {"by", by}, {"words", decided.supervision.words}});
    outcome_.restrictions.push_back({ns(Clock::now()), decided.seq.value, what, by});
    guard_ = words.empty() ? "" : by;
    if (!decided.supervision.words.empty())
      outcome_.words.push_back({ns(Clock::now()), decided.seq.value, 0, decided.supervision.words});
  }
  void take(const WordsSaid& said) {
    replica_.note(said.seq);
    log::info("words", {{"room_seq", said.seq.value}, {"from", said.from.value}, {"words", said.words}});
    outcome_.words.push_back({ns(Clock::now()), said.seq.value, said.from.value, said.words});
  }
  // Others' tools are felt as solids, if the room's tools contain them.
  void make_partner_solid(const std::string& name) {
    for (const ToolBox::Entry* entry : room_.tools()->entries()) {
      if (entry->tool.name != name) continue;
      std::shared_ptr<const SolidLattice>& solid = solids_[entry->hash];
      if (!solid) solid = std::make_shared<const SolidLattice>(entry->tool);
      if (known_solids_.count == PartnerSolids::kMost) return;
      known_solids_.of[known_solids_.count++] = {std::hash<std::string>{}(name), solid.get()};
      partner_solids_.store(known_solids_);
      return;
    }
  }
  void take(const EventNoted& noted) { replica_.note(noted.seq); }
  void take(const SceneSet& scene) {
    replica_.note(scene.seq);
    std::vector<PlacedGuide>& guides = guides_.writable();
    guides.clear();
    for (const SceneItem& item : scene.items)
      if (const ToolBox::Entry* entry = room_.tools()->find(item.tool)) {
        // Made once for each definition, because it takes up to a tenth of a second.
        std::shared_ptr<const SolidLattice>& solid = solids_[item.tool];
        if (!solid) solid = std::make_shared<const SolidLattice>(entry->tool);
        guides.push_back(placed_guide(item.id, entry->tool, item.pose_bone_item, solid));
      }
    guides_.publish();
  }
  void take(const CutCommitted& committed) {
    const bool own = committed.cut.author == room_.room().author;
    if (own) cut_log_.confirm(committed.cut.author_seq, committed.seq, ns(Clock::now()));
    if (own) rejected_in_a_row_ = 0;
    replica_.commit(committed.seq, committed.cut, own);
  }
  void take(const CutRejected& rejected) {
    cut_log_.confirm(rejected.author_seq, RoomSeq{}, ns(Clock::now()));
    const bool fell = replica_.reject(rejected.seq, rejected.author_seq);
    follow_lease(rejected.lease_epoch);
    switch (rejected.reason) {  // an instructor's decision that was on its way when this was cut
      case Rejection::frozen:
        return static_cast<void>(++outcome_.cuts_stopped);
      case Rejection::taken:
        return static_cast<void>(++outcome_.cuts_taken);
      case Rejection::zone:
      case Rejection::forbidden_tool:
        return static_cast<void>(++outcome_.cuts_elsewhere);
      default:
        break;
    }
    if (!fell) return;  // it was dropped by an undo, or with an earlier cut
    // An occasional rejected cut gives its bone back. A room that rejects all cuts makes further work pointless.
    constexpr int kMostInARow = 20;
    if (rejected_in_a_row_++ == 0)
      log::warn("cut rejected", {{"author_seq", rejected.author_seq}, {"reason", rejected.sentence}});
    if (rejected_in_a_row_ != kMostInARow) return;
    give_up({ErrorCode::unsupported, "the server rejects every cut: " + rejected.sentence});
  }

  void watch_room(bool any_received) {
    const double now_s = 1e-9 * static_cast<double>(ns(Clock::now()));
    // Without a connection everything that will be cut is unconfirmed.
    const bool silent = interrupted_ && replica_.unconfirmed() == 0;
    const RoomHealth health = watch_.update(now_s, any_received && !interrupted_, silent ? 1 : replica_.unconfirmed());
    unconfirmed_ = replica_.unconfirmed();
    const RoomHealth before = room_health_.exchange(health);
    if (health == before) return;
    if (health == RoomHealth::follows)
      log::info("the server follows again");
    else
      log::warn("the spindle is held", {{"because", name(health)}, {"unconfirmed_cuts", replica_.unconfirmed()}});
    if (health == RoomHealth::lost && link_ok_)
      give_up({ErrorCode::unavailable, interrupted_
                                           ? "the connection to the server was not restored; see whether osteon-server "
                                             "still runs and can be reached"
                                           : "the server has not answered " + std::to_string(replica_.unconfirmed()) +
                                                 " cuts; see whether it runs and can be reached"});
  }

  void build_patch() {
    places_.refresh();
    const ToolPlace& place = places_.value();
    if (!place.taken_up) return;
    note_removed(place.step);
    const std::vector<ChangedLeaves> changes = replica_.take_changes();
    const double moved_mm = (place.pose_bone_tool.position_mm - built_at_.position_mm).norm();
    if (changes.empty() && moved_mm < 0.05 && place.tool == built_tool_) return;

    const auto began = Clock::now();
    for (const ChangedLeaves& change : changes) builder_.changed(room_.bone().pitch_mm(), change.level, change.origins);
    Patch& patch = patches_.writable();
    builder_.build(replica_.bodies(), session_.loop().tool(place.tool), place.pose_bone_tool, patch);
    patch.own_cuts = replica_.last_own();
    patch.room_seq = replica_.room_seq();
    patches_.publish();
    built_at_ = place.pose_bone_tool;
    built_tool_ = place.tool;
    ++outcome_.patches;
    patch_times_.record(Clock::now() - began);
  }

  // Notes the bone removed by the steps before this one, unless it was noted.
  void note_removed(std::size_t step) {
    for (; noted_steps_ < step && noted_steps_ < outcome_.removed_mm3.size(); ++noted_steps_) {
      const double removed = replica_.removed_mm3();
      outcome_.removed_mm3[noted_steps_] = removed - noted_mm3_;
      noted_mm3_ = removed;
    }
  }

  void reporter_thread() {
    auto next_status = Clock::now() + 1s;
    TickRow row;
    while (true) {
      const bool over = all_over_;
      bool any = false;
      while (rows_.try_pop(row)) {
        any = true;
        log_.write(row, tool_name(row));
        note_range(row);
        note_restrictions(row);
        recorder_.push(row);
      }
      if (realtime_refused_.exchange(false))
        log::warn("the haptic loop has no real-time priority", {{"remedy", "see osteon-haptic check"}});
      if (any && link_ok_) room_.send(state_of(row));
      if (pushes_.refresh() && link_ok_) room_.send(pushes_.value());
      if (Clock::now() >= lag_asked_ + 200ms) {
        lag_asked_ = Clock::now();
        line_lag_s_ = 1e-3 * room_.fast_path().round_trip_ms;
      }
      set_items();
      if (over) break;
      if (options_.status && any && Clock::now() >= next_status) {
        next_status += 1s;
        print_status(row);
      }
      std::this_thread::sleep_for(4ms);
    }
  }

  // Enters the items that the plan has left on the bone into the room's scene. Guides come back from there and guide
  // the tool.
  void set_items() {
    for (; items_set_ < items_left_ && link_ok_ && Clock::now() >= items_from_; ++items_set_) {
      const LeftItem& left = session_.left()[items_set_];
      SceneItem item;
      item.tool = session_.plan().steps[left.step].item.hash();
      item.pose_bone_item = left.pose_bone_item;
      item.turns = left.turns;
      const Result<std::uint32_t> set = room_.set_item(item);
      if (!set && set.error().code == ErrorCode::denied) {  // a stopped person places nothing until the stop is over
        log::warn("an item cannot be placed yet", {{"because", set.error().message}});
        items_from_ = Clock::now() + 2s;
        return;
      }
      if (!set) give_up(set.error());
    }
  }

  [[nodiscard]] const std::string& tool_name(const TickRow& row) const {
    return tool_names_[static_cast<std::size_t>(row.report.tool)];
  }

  void note_range(const TickRow& row) {
    if (row.report.out_of_range == 0 && !(row.report.events & kOnMetal)) return;
    const ToolModel& model = session_.plan().tools[static_cast<std::size_t>(row.report.tool)];
    const std::string outside = ranges_.note(model, row.report), metal = metal_.note(model, row.report);
    if (!outside.empty()) log::warn("force law outside its range", {{"tool", model.tool.name}, {"because", outside}});
    if (!metal.empty()) log::warn("metal", {{"because", metal}});
  }

  // Notes the effects in the loop, tick by tick: the time of a stop is known to the millisecond.
  void note_restrictions(const TickRow& row) {
    const LoopReport& r = row.report;
    const bool forbidden = (r.events & kForbidden) != 0, led = (r.events & kHandGuided) != 0;
    if (forbidden != was_forbidden_) loop_notes_.push_back({row.mono_ns, 0, forbidden ? "may not cut" : "may cut"});
    if (led != was_led_) loop_notes_.push_back({row.mono_ns, 0, led ? "is led" : "is no longer led"});
    was_forbidden_ = forbidden;
    was_led_ = led;
    outcome_.forbidden_ticks += forbidden;
    if (forbidden || led)
      outcome_.supervised_step_n = std::max(outcome_.supervised_step_n, row.force_rendered_n - force_before_n_);
    force_before_n_ = row.force_rendered_n;
    if (!led) return;
    outcome_.guide_mm = r.guide_distance_mm;
    outcome_.guide_most_mm = std::max(outcome_.guide_most_mm, r.guide_distance_mm);
  }

  [[nodiscard]] CuttingState state_of(const TickRow& row) const {
    const LoopReport& r = row.report;
    CuttingState state;
    state.author = room_.room().author;
    state.state_seq = r.state_seq;
    state.pose_bone_tool = r.pose_bone_proxy;
    state.pose_bone_device = r.pose_bone_device;
    state.tool_name = tool_name(row);
    state.spindle_rpm = r.spindle_rpm;
    state.feed_mm_per_s = r.feed_mm_per_s;
    state.density_g_cm3 = r.density_g_cm3;
    state.engaged_fraction = r.engaged;
    state.force_physical_N = r.force_physical_n;
    state.torque_Nmm = r.torque_nmm;
    state.depth_mm = row.depth_mm;
    state.phase = r.phase;
    state.on_metal = (r.events & kOnMetal) != 0;
    return state;
  }

  void print_status(const TickRow& row) {
    const LoopReport& r = row.report;
    std::printf("%s %s: depth %.1f mm, force %.1f N, feed %.2f mm/s, %.0f rpm (%s)", tool_name(row).c_str(),
                name(row.phase), row.depth_mm, r.force_physical_n.norm(), r.feed_mm_per_s, r.spindle_rpm,
                name(r.phase));
    if (r.out_of_range != 0)
      std::printf(", outside the range of its law: %s", out_of_range_words(r.out_of_range).c_str());
    const RoomHealth health = room_health_;
    if (r.events & kOnMetal) std::printf(", on metal, which it does not cut");
    if (r.events & kForbidden) std::printf(", stopped by %s", guard_.empty() ? "an instructor" : guard_.c_str());
    if (r.events & kHandGuided) std::printf(", led, %.1f mm off", r.guide_distance_mm);
    if (health != RoomHealth::follows)
      std::printf(", held: %s, %zu cuts unconfirmed", name(health), unconfirmed_.load());
    if (live_.refresh()) {
      const TickStats now = live_.value().since(last_ticks_);
      last_ticks_ = live_.value();
      std::printf(", loop %.0f us (99 of 100: %.0f), late %.0f us (%.0f), %llu missed", now.work.percentile_us(50),
                  now.work.percentile_us(99), now.lateness.percentile_us(50), now.lateness.percentile_us(99),
                  static_cast<unsigned long long>(now.missed));
    }
    std::printf("\n");
    std::fflush(stdout);
  }

  RoomSession& room_;
  const ClientOptions& options_;
  const StopSignal& stop_;
  Session& session_;                     // haptic thread; the replica's thread empties its queue of cuts
  FeltMount mounted_;                    // haptic thread
  Replica replica_;                      // replica thread, until it is joined
  PatchBuilder builder_;                 // replica thread
  CutLog cut_log_;                       // replica thread, until it is joined
  SessionLog log_;                       // reporter thread
  Recorder recorder_;                    // filled by the reporter thread
  RangeWatch ranges_;                    // reporter thread, until it is joined
  MetalWatch metal_;                     // reporter thread
  std::vector<std::string> tool_names_;  // never changes

  TripleBuffer<Patch> patches_;                                   // replica → haptic
  TripleBuffer<ToolPlace> places_;                                // haptic → replica
  TripleBuffer<std::vector<PlacedGuide>> guides_;                 // all items of the room's scene, replica → haptic
  std::map<Digest, std::shared_ptr<const SolidLattice>> solids_;  // of its definitions; replica thread
  TripleBuffer<HapticRestrictions> restrictions_;                 // an instructor's restrictions, session → haptic
  TripleBuffer<MountUpdate> places_of_bone_;                      // session → haptic
  std::atomic<std::uint64_t> line_{1};                            // number of the present connection
  TripleBuffer<MountLoad> pushes_;                                // haptic → reporter
  std::atomic<std::uint64_t> stop_flag_{0};                       // the newest datagram's stop flag, likewise
  TripleBuffer<Partners> partners_;                               // others' tools, session → haptic
  Partners received_partners_;                                    // written by the session's thread, like the next
  std::set<std::string> named_tools_;
  TripleBuffer<PartnerSolids> partner_solids_;  // replica → haptic
  PartnerSolids known_solids_;                  // replica thread
  // Age of a partner's state on arrival; assumes that both connections have equal delay.
  std::atomic<double> line_lag_s_{0};
  SpscQueue<TickRow, 2048> rows_;                       // haptic → reporter
  TripleBuffer<TickStats> live_;                        // haptic → reporter, once a second
  TickStats last_ticks_;                                // reporter: of the last line
  std::optional<Clock::time_point> stall_reported_at_;  // watchdog
  std::array<std::atomic<std::int64_t>, kTickTimes> tick_times_;

  std::mutex mutex_;  // guards the three below; never taken by the haptic thread
  bool replica_over_ = false;
  std::deque<RoomMessage> from_room_;
  std::vector<std::string> tools_to_make_;  // of partners; the solids are not made yet
  std::optional<Error> lost_why_;
  std::condition_variable wake_, taken_;
  std::atomic<std::int64_t> received_ns_{0};
  std::atomic<RoomHealth> room_health_{RoomHealth::follows};
  std::atomic<std::size_t> unconfirmed_{0};
  std::atomic<std::size_t> items_left_{0};  // by the plan
  std::size_t items_set_ = 0;               // in the room's scene; reporter thread
  Clock::time_point items_from_{};          // earliest time of the next attempt; reporter thread
  std::atomic<bool> link_ok_{true}, realtime_refused_{false}, joined_{false}, touching_over_{false}, all_over_{false};

  // Haptic thread.
  TickRow row_;
  LoopReport last_;
  std::array<PartnerTool, Partners::kMost> felt_partners_;
  const EntrySite* site_ = nullptr;
  bool taken_up_ = false;
  // Reporter thread.
  Clock::time_point lag_asked_{};
  bool was_forbidden_ = false, was_led_ = false;
  double force_before_n_ = 0;
  std::vector<RestrictionNote> loop_notes_;
  // Replica thread.
  bool supervised_ = false;    // the hand is restricted
  std::string guard_;          // by whom, as far as the room says it
  std::uint64_t lease_epoch_;  // of the room, as far as received
  std::deque<Cut> unsent_;     // bounded like the unconfirmed cuts
  Pose built_at_;
  int built_tool_ = -1;
  int rejected_in_a_row_ = 0;
  bool changing_ = false;     // part of a change of the bone has been received
  bool interrupted_ = false;  // since then leaves are collected here
  std::vector<FieldLeaf> renewed_;
  ConfirmationMonitor watch_;
  std::size_t noted_steps_ = 0;
  double noted_mm3_ = 0;
  DurationHistogram patch_times_;

  ClientOutcome outcome_;
  Watchdog watchdog_{kStall, kPriority + 1, [this] { stalled(); }};  // last: its thread uses the other members
};

}  // namespace

Result<ClientOutcome> run_client(RoomSession& room, Session& session, const ClientOptions& options,
                                 const StopSignal& stop) {
  // On the heap because it is large: it contains its queues.
  const auto client = std::make_unique<Client>(room, session, options, stop);
  return client->run();
}

}  // namespace osteon::haptic
