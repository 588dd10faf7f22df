#include "server/rpc/link_server.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

namespace osteon {
namespace {

using Time = std::chrono::nanoseconds;
using namespace std::chrono_literals;

constexpr int kMostInSuccession = 256;  // datagrams received before others are sent, as there may be floods
constexpr Time kLongestWait = 100ms;

// The clock of all links of this process.
Time now_of_links() {
  static const auto start = std::chrono::steady_clock::now();
  return std::chrono::steady_clock::now() - start;
}

}  // namespace

SessionLink::SessionLink(const SessionKeys& keys, AuthorId author, std::uint64_t first_author_seq, Receiver& receiver)
    : keys_(keys), author_(author), receiver_(&receiver), link_(keys, author, system_random(), first_author_seq) {}

SessionLink::News SessionLink::news() {
  News news;
  while (std::optional<Cut> cut = link_.take_cut()) news.cuts.push_back(std::move(*cut));
  if (std::optional<wire::KnownToolState> state = link_.take_state()) {
    state->state.author = author_;
    news.state = std::move(state->state);
  }
  news.push = link_.take_push();
  if (link_.acknowledged() > arrived_) news.arrived = arrived_ = link_.acknowledged();
  return news;
}

void SessionLink::say(News news) {
  if (!receiver_) return;
  for (Cut& cut : news.cuts) receiver_->take(std::move(cut));
  if (news.state) receiver_->take(std::move(*news.state));
  if (news.push) receiver_->pushed(*news.push);
  if (news.arrived > 0) receiver_->arrived(news.arrived);
}

void SessionLink::insert(const Cut& cut) {
  const MutexLock delivery(delivery_mutex_);
  News next;
  {
    const MutexLock lock(mutex_);
    link_.insert(cut);
    next = news();
  }
  say(std::move(next));
}

bool SessionLink::enqueue(std::uint64_t index, const wire::SessionEntry& entry) {
  bool goes = false;
  {
    const MutexLock lock(mutex_);
    goes = link_.enqueue(index, entry);
  }
  if (server_) server_->wake();
  return goes;
}

void SessionLink::know_tool(std::uint32_t number, const Digest& tool) {
  const MutexLock lock(mutex_);
  link_.tools().add(number, tool);
}

bool SessionLink::set_partners(std::span<const CuttingState> partners) {
  {
    const MutexLock lock(mutex_);
    if (!link_.alive(now_of_links())) return false;
    std::vector<wire::KnownToolState> states;
    for (const CuttingState& state : partners) states.push_back({state, 0});
    link_.set_partners(states);
  }
  if (server_) server_->wake();
  return true;
}

bool SessionLink::set_bone(const MountPose& seen) {
  {
    const MutexLock lock(mutex_);
    if (!link_.alive(now_of_links())) return false;
    link_.set_bone(seen);
  }
  if (server_) server_->wake();
  return true;
}

void SessionLink::close() {
  const MutexLock delivery(delivery_mutex_);
  receiver_ = nullptr;
}

Result<std::unique_ptr<LinkServer>> LinkServer::open(const std::string& address, std::uint16_t port) {
  Result<std::unique_ptr<UdpPort>> opened = UdpPort::open({.address = address, .port = port});
  if (!opened) return tl::unexpected(opened.error());
  return std::unique_ptr<LinkServer>(new LinkServer(std::move(*opened)));
}

LinkServer::LinkServer(std::unique_ptr<UdpPort> port) : port_(std::move(port)) {
  thread_ = std::thread([this] { run(); });
}

LinkServer::~LinkServer() {
  {
    const MutexLock lock(mutex_);
    end_ = true;
  }
  port_->wake();
  thread_.join();
}

std::shared_ptr<SessionLink> LinkServer::add(AuthorId author, std::uint64_t first_author_seq,
                                             SessionLink::Receiver& receiver) {
  std::shared_ptr<SessionLink> link;
  {
    const MutexLock lock(mutex_);
    std::uint32_t session = 0;
    while (session == 0 || links_.contains(session)) {
      std::array<std::uint8_t, 4> bytes{};
      random_(bytes);
      session = std::uint32_t{bytes[0]} | std::uint32_t{bytes[1]} << 8 | std::uint32_t{bytes[2]} << 16 |
                std::uint32_t{bytes[3]} << 24;
    }
    link = std::make_shared<SessionLink>(make_session_keys(session, random_), author, first_author_seq, receiver);
    link->server_ = this;
    links_[session] = link;
  }
  port_->wake();
  return link;
}

void LinkServer::remove(const std::shared_ptr<SessionLink>& link) {
  {
    const MutexLock lock(mutex_);
    links_.erase(link->keys().session);
  }
  link->close();
}

std::vector<std::shared_ptr<SessionLink>> LinkServer::links() const {
  const MutexLock lock(mutex_);
  std::vector<std::shared_ptr<SessionLink>> all;
  for (const auto& [session, link] : links_) all.push_back(link);
  return all;
}

LinkServerHealth LinkServer::health() const {
  LinkServerHealth health;
  health.port = port_->counts();
  for (const auto& link : links()) {
    const MutexLock lock(link->mutex_);
    ++health.links;
    health.alive += link->link_.alive(now_of_links());
  }
  const MutexLock lock(mutex_);
  health.unauthenticated = unauthenticated_;
  return health;
}

void LinkServer::receive_some(Time now) {
  DatagramBuffer buffer;
  for (int i = 0; i < kMostInSuccession; ++i) {
    const std::optional<Datagram> datagram = port_->receive(buffer);
    if (!datagram) return;
    const std::optional<std::uint32_t> session = session_of(datagram->bytes);
    std::shared_ptr<SessionLink> link;
    {
      const MutexLock lock(mutex_);
      const auto found = session ? links_.find(*session) : links_.end();
      if (found == links_.end())
        ++unauthenticated_;
      else
        link = found->second;
    }
    if (!link) continue;
    const MutexLock delivery(link->delivery_mutex_);
    SessionLink::News news;
    {
      const MutexLock lock(link->mutex_);
      link->link_.receive(datagram->from, datagram->bytes, now);
      news = link->news();
    }
    link->say(std::move(news));
  }
}

Time LinkServer::send_due(Time now) {
  DatagramBuffer buffer;
  Time next = now + kLongestWait;
  for (const auto& link : links()) {
    const MutexLock lock(link->mutex_);
    while (const std::optional<wire::ServerLink::Out> out = link->link_.send(now, buffer))
      port_->send(out->to, out->bytes);
    next = std::min(next, link->link_.next(now));
  }
  return next;
}

void LinkServer::run() {
  while (true) {
    {
      const MutexLock lock(mutex_);
      if (end_) return;
    }
    receive_some(now_of_links());
    const Time now = now_of_links();
    port_->wait(std::max(send_due(now) - now, Time{0}));
  }
}

}  // namespace osteon
