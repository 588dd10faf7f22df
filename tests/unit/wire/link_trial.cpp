#include "tests/unit/wire/link_trial.hpp"

#include <algorithm>
#include <utility>

namespace osteon::test {

Trial::Trial(const TrialOptions& options)
    : options_(options), network(time, options.seed), random_(options.seed), server_port(network.open(node(1))) {
  network.set_quality(options.quality);
  server_port->on_arrival([this] { receive_server(); });
  for (std::size_t c = 0; c < kClients; ++c) {
    const SessionKeys keys = make_session_keys(static_cast<std::uint32_t>(c + 1), seeded(options.seed * 3 + c));
    clients.push_back(std::make_unique<Client>(c, keys, options));
    sessions.push_back(std::make_unique<Session>(c, keys, options));
    for (std::uint32_t tool = 1; tool <= kClients; ++tool) {
      clients[c]->link.tools().add(tool, tool_of(tool));
      sessions[c]->link.tools().add(tool, tool_of(tool));
    }
    move_client(c, node(2 + c));
    time.post(Time{}, [this, c] { turn(c); });
    time.post(kCut / 2 * static_cast<int>(c), [this, c] { make_cuts(c); });
  }
  time.post(3ms, [this] { tick(); });
}

void Trial::move_client(std::size_t c, const Endpoint& to) {
  clients[c]->port.reset();
  clients[c]->port = network.open(to);
  clients[c]->port->on_arrival([this, c] { turn(c); });
}

bool Trial::settled() const {
  for (std::size_t c = 0; c < kClients; ++c) {
    if (sessions[c]->cuts.size() != clients[c]->cuts.size() || sessions[c]->durable != clients[c]->cuts.size())
      return false;
    if (clients[c]->entries.size() != sessions[c]->entries.size()) return false;
    if (clients[c]->link.acknowledged() != sessions[c]->durable) return false;
  }
  return true;
}

Time Trial::settle(Time timeout) {
  const Time from = time.now();
  while (!settled() && time.now() - from < timeout) time.run_until(time.now() + 10ms);
  return time.now() - from;
}

bool Trial::exact() const {
  for (std::size_t c = 0; c < kClients; ++c) {
    const auto &arrived = sessions[c]->cuts, &made = clients[c]->cuts;
    if (arrived.size() > made.size() || !std::equal(arrived.begin(), arrived.end(), made.begin())) return false;
    const auto &taken = clients[c]->entries, &sent = sessions[c]->entries;
    if (taken.size() > sent.size()) return false;
    for (std::size_t i = 0; i < taken.size(); ++i)
      if (taken[i].index != i + 1 || taken[i].entry != sent[i].entry) return false;
    if (clients[c]->link.acknowledged() > sessions[c]->durable) return false;
  }
  return true;
}

void Trial::stream(Action there) {
  Time at = time.now() + options_.stream_delay;
  for (const auto& [from, until] : stream_stops_)
    if (time.now() >= from && time.now() < until) at = std::max(at, until + 2 * options_.stream_delay);
  stream_at_ = std::max(stream_at_, at);
  time.post(stream_at_, std::move(there));
}

void Trial::wake(std::optional<Time>& wakes_at, Time at, Action action) {
  if (at == Time::max() || (wakes_at && *wakes_at <= at && *wakes_at > time.now())) return;
  wakes_at = at;
  time.post(at, std::move(action));
}

void Trial::make_cuts(std::size_t c) {
  Client& client = *clients[c];
  time.post_in(kCut, [this, c] { make_cuts(c); });
  CuttingState& state = client.state;
  ++state.state_seq;
  state.phase = client.cutting ? CuttingPhase::cutting : CuttingPhase::free;
  state.tool_name = "drill-3.5";
  // The hand trembles by less than anyone sees.
  const Pose tremor{.position_mm = random_.in_cube(0.004)};
  if (client.cutting) {
    const std::uint64_t number = client.cuts.size() + 1;
    Cut cut = options_.cut ? options_.cut(c, number) : drilling(client, number);
    cut.author = client.author;
    cut.author_seq = number;
    state.pose_bone_tool = state.pose_bone_device = dequantise(cut.path.back());
    client.cuts.push_back(cut);
    client.made_at.push_back(time.now());
    client.most_waiting = std::max(client.most_waiting, client.link.half().window().bytes_unacknowledged());
    if (!client.link.push(cut)) {
      ++client.refused;
      stream([this, c, cut] { sessions[c]->link.insert(cut); });
    }
  }
  CuttingState trembling = state;
  trembling.pose_bone_tool.position_mm += tremor.position_mm;
  client.link.set_state(trembling, 0);
  turn(c);
}

Digest Trial::tool_of(std::uint64_t number) {
  Digest tool;
  tool.bytes.fill(static_cast<std::uint8_t>(number));
  return tool;
}

Cut Trial::drilling(const Client& client, std::uint64_t number) {
  Cut cut;
  cut.lease_epoch = 1 + number / 300;
  cut.tool = tool_of(client.author.value - 9);
  cut.spindle_rpm = 1000;
  cut.path_us = 8000;
  QuantisedPose pose = client.cuts.empty() ? QuantisedPose{} : client.cuts.back().path.back();
  cut.path.push_back(pose);
  for (std::size_t knots = random_.unit() < options_.long_cuts ? 30 : 1 + random_.index(2); knots > 0; --knots) {
    for (auto& p : pose.position) p += static_cast<std::int32_t>(random_.index(101)) - 50;
    for (auto& r : pose.rotation) r = static_cast<std::int16_t>(r - static_cast<std::int16_t>(random_.index(21)) + 10);
    cut.path.push_back(pose);
  }
  return cut;
}

void Trial::turn(std::size_t c) {
  Client& client = *clients[c];
  const Time now = time.now();
  DatagramBuffer buffer;
  while (const auto got = client.port->receive(buffer)) client.link.receive(got->bytes, now);
  while (auto entry = client.link.take_entry()) client.in_order.insert(entry->index, std::move(entry->entry));
  while (auto entry = client.in_order.take()) {
    const bool of_other = entry->kind == wire::SessionEntryKind::committed && entry->cut.author != client.author;
    if (of_other) {
      const Client& other = *clients[entry->cut.author.value - 10];
      const Time since = other.made_at.at(entry->cut.author_seq - 1);
      client.felt_ms.push_back(std::chrono::duration<double, std::milli>(now - since).count());
    }
    client.entries.push_back({client.in_order.acknowledged(), std::move(*entry)});
  }
  if (!client.link.alive(now)) {
    for (std::uint64_t n = std::max(client.link.acknowledged(), client.streamed_cuts) + 1; n <= client.cuts.size();
         ++n) {
      stream([this, c, cut = client.cuts[n - 1]] { sessions[c]->link.insert(cut); });
      client.streamed_cuts = n;
    }
    if (client.acknowledged_entries != client.link.entries_arrived()) {
      client.acknowledged_entries = client.link.entries_arrived();
      stream([this, c, upto = client.acknowledged_entries] { sessions[c]->link.acknowledge(upto); });
    }
  }
  for (;;) {
    const auto bytes = client.link.send(now, buffer);
    if (bytes.empty()) break;
    client.uplink_bytes += bytes.size() + 28;
    if (!tap || !tap(c, bytes)) client.port->send(server_port->local(), bytes);
  }
  wake(client.wakes_at, client.link.next(now), [this, c] { turn(c); });
}

void Trial::receive_server() {
  DatagramBuffer buffer;
  while (const auto got = server_port->receive(buffer)) {
    const auto session = session_of(got->bytes);
    if (!session || *session < 1 || *session > kClients) continue;
    sessions[*session - 1]->link.receive(got->from, got->bytes, time.now());
    server_turn(*session - 1);
  }
}

void Trial::server_turn(std::size_t c) {
  Session& session = *sessions[c];
  DatagramBuffer buffer;
  while (const auto out = session.link.send(time.now(), buffer)) {
    session.downlink_bytes += out->bytes.size() + 28;
    server_port->send(out->to, out->bytes);
  }
  wake(session.wakes_at, session.link.next(time.now()), [this, c] { server_turn(c); });
}

void Trial::send_entry(std::size_t c, wire::SessionEntry entry) {
  Session& session = *sessions[c];
  session.entries.push_back({session.entries.size() + 1, std::move(entry)});
  if (!session.link.push(session.entries.back())) stream_entry(c, session.entries.size());
}

void Trial::stream_entry(std::size_t c, std::uint64_t index) {
  stream([this, c, entry = sessions[c]->entries[index - 1]] {
    if (clients[c]->link.received_one(entry.index)) {
      ++clients[c]->entries_by_stream;
      clients[c]->in_order.insert(entry.index, entry.entry);
    }
    turn(c);
  });
}

void Trial::tick() {
  time.post_in(kTick, [this] { tick(); });
  std::vector<std::pair<std::size_t, Cut>> decided;
  for (std::size_t c = 0; c < kClients; ++c) {
    while (auto cut = sessions[c]->link.take_cut()) {
      sessions[c]->cuts.push_back(*cut);
      decided.emplace_back(c, std::move(*cut));
    }
  }
  const bool event = random_.unit() < options_.events;
  if (!decided.empty() || event) time.post_in(kWrite, [this, decided, event] { make_durable(decided, event); });
  for (std::size_t c = 0; c < kClients; ++c) {
    Session& session = *sessions[c];
    if (auto state = sessions[c]->link.take_state()) {
      const std::vector<wire::KnownToolState> partners{*state};
      sessions[1 - c]->link.set_partners(partners);
    }
    if (!session.link.alive(time.now())) {
      for (std::uint64_t i = std::max(session.link.acknowledged(), session.streamed_entries) + 1;
           i <= session.entries.size(); ++i)
        stream_entry(c, session.streamed_entries = i);
      if (session.acknowledged != session.durable) {
        session.acknowledged = session.durable;
        stream([this, c, upto = session.durable] { clients[c]->link.acknowledge(upto); });
      }
    }
    server_turn(c);
  }
}

// An instructor's decision about one of the clients. Every third is too long for a packet.
wire::SessionEntry Trial::supervised(RoomSeq seq) {
  wire::SessionEntry entry{.room_seq = seq, .kind = wire::SessionEntryKind::supervised, .lease_epoch = seq.value + 1};
  entry.supervision = {
      .stopped = seq.value % 2 == 0, .force_limit = static_cast<int>(seq.value % 1000), .words = "as agreed"};
  entry.by = {AuthorId{1 + seq.value % 5}, seq.value % 5 == 0 ? "" : "Dr. Weber"};
  for (std::uint64_t tool = 1; tool <= seq.value % 9 * 2; ++tool) entry.supervision.tools.push_back(tool_of(tool));
  return entry;
}

void Trial::make_durable(const std::vector<std::pair<std::size_t, Cut>>& decided, bool event) {
  for (const auto& [author, cut] : decided) {
    const RoomSeq seq{++room_seq_};
    if (options_.reject_each != 0 && cut.author_seq % options_.reject_each == 0) {
      send_entry(author, {.room_seq = seq,
                          .kind = wire::SessionEntryKind::rejected,
                          .author_seq = cut.author_seq,
                          .reason = 3,
                          .lease_epoch = 1 + cut.author_seq / 300});
    } else {
      for (std::size_t c = 0; c < kClients; ++c)
        send_entry(c, {.room_seq = seq, .kind = wire::SessionEntryKind::committed, .cut = cut});
    }
    sessions[author]->durable = cut.author_seq;
  }
  if (event) {
    const RoomSeq seq{++room_seq_};
    for (std::size_t c = 0; c < kClients; ++c)
      send_entry(c, seq.value % 3 == c ? supervised(seq) : wire::SessionEntry{.room_seq = seq});
  }
  for (std::size_t c = 0; c < kClients; ++c) {
    sessions[c]->link.decided(sessions[c]->durable);
    server_turn(c);
  }
}

}  // namespace osteon::test
